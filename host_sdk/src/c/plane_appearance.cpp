// C ABI of PlaneReader and PlaneAppearance.
#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <string>

#include <lightwell/plane_appearance.h>
#include <lightwell/plane_appearance.hpp>

#include "c/call.hpp"
#include "c/plane_handle.hpp"

struct lw_plane_reader {
  static constexpr std::uint64_t kKind = 0x64725f6e6c70776cU;  // "lwpln_rd"
  static constexpr const char* kRefusal = "this is not an lw_plane_reader of lw_plane_reader_create";

  lightwell::c::HandleTag tag{kKind};
  lightwell::PlaneReader value;
};

namespace lightwell::c {
namespace {

static_assert(LW_PLANE_ALL == static_cast<int>(PlaneLayers::all) &&
              LW_PLANE_DIFFUSE == static_cast<int>(PlaneLayers::diffuse) &&
              LW_PLANE_SPECULAR == static_cast<int>(PlaneLayers::specular));
constexpr int flag_bit(PlaneFlag flag) { return 1 << static_cast<int>(flag); }
static_assert(LW_PLANE_UNSEEN_DIRECTION == flag_bit(PlaneFlag::unseen_direction) &&
              LW_PLANE_CLIPPED_DIRECTION == flag_bit(PlaneFlag::clipped_direction) &&
              LW_PLANE_UNSEEN_TEXEL == flag_bit(PlaneFlag::unseen_texel) &&
              LW_PLANE_CLIPPED_TEXEL == flag_bit(PlaneFlag::clipped_texel));
static_assert(LW_CAPTURE_KEEP_MOVING == static_cast<int>(CaptureProgress::keep_moving) &&
              LW_CAPTURE_ENOUGH == static_cast<int>(CaptureProgress::enough));

void put(const Vec3d& v, double* out) { std::ranges::copy(std::array{v.x, v.y, v.z}, out); }

Status write_answer(const PlaneAppearance& plane, const PlaneAnswer& answer, lw_plane_answer* to) {
  lw_plane_answer out{};
  out.validity = static_cast<lw_validity>(answer.validity);
  for (int k = 0; k < 3; ++k) out.value[k] = answer.value[k];
  out.flags = answer.flags.bits();
  out.units = static_cast<lw_units>(plane.info().units);
  return write_sized(out, "lw_plane_answer", to);
}

template <class Work>
lw_status plane_query(const lw_plane* plane, lw_plane_answer* out, const Work& work) {
  return write_failure(with_handle(plane, work), "lw_plane_answer", out);
}

lw_plane_info as_c(const PlaneAppearance& plane) {
  lw_plane_info out{};
  out.validity = static_cast<lw_validity>(plane.validity());
  out.age_ns = plane.age().ns;
  out.revision = plane.revision();
  out.gloss_alpha = out.f0 = -1;
  if (out.revision == 0) return out;
  const PlaneInfo& info = plane.info();
  out.missing_tiles = plane.missing_tiles();
  out.capture = info.capture;
  out.texture_edge = plane.texture_edge();
  out.mid_exposure_ns = info.mid_exposure.ns;
  out.side = info.size_m;
  out.texture_position[0] = info.texture_to_plane.x_m;
  out.texture_position[1] = info.texture_to_plane.y_m;
  out.texture_rotation = info.texture_to_plane.rotation_rad;
  out.texture_scale = info.texture_to_plane.scale;
  if (info.T_probe_plane) {
    const auto& [q, t] = *info.T_probe_plane;
    put(t, out.position);
    std::ranges::copy(std::array{q.x, q.y, q.z, q.w}, out.orientation);
    out.pose_known = 1;
  }
  out.units = static_cast<lw_units>(info.units);
  out.gloss_alpha = info.gloss_alpha.value_or(-1.0F);
  out.f0 = info.f0.value_or(-1.0F);
  return out;
}

}  // namespace
}  // namespace lightwell::c

using namespace lightwell;
using namespace lightwell::c;

extern "C" {

lw_status lw_plane_reader_create(lw_plane_reader** out) { return create(out); }

void lw_plane_reader_release(lw_plane_reader* reader) {
  if (good(reader)) delete reader;
}

lw_status lw_plane_reader_take(lw_plane_reader* reader, const void* message, size_t length, int64_t received_ns) {
  return with_handle(reader, [&](PlaneReader& r) {
    if (message == nullptr && length > 0) return null_argument("message");
    return r.take({static_cast<const std::byte*>(message), length}, {received_ns});
  });
}

lw_status lw_plane_reader_snapshot(lw_plane_reader* reader, int64_t now_ns, lw_plane* into) {
  return fill(reader, into, [&](PlaneReader& r) { return r.snapshot({now_ns}); });
}

lw_status lw_plane_reader_get_stats(const lw_plane_reader* reader, lw_plane_reader_stats* out) {
  return with_handle(reader, [&](const PlaneReader& r) {
    const PlaneReaderStats& stats = r.stats();
    const lw_plane_reader_stats made{sizeof made, 0, stats.messages, stats.refused, stats.tiles, stats.tiles_unused};
    return write_sized(made, "lw_plane_reader_stats", out);
  });
}

lw_status lw_probe_plane(const lw_probe* probe, lw_plane* into) {
  return fill(probe, into, [](const Probe& p) { return p.plane(); });
}

lw_status lw_plane_create(lw_plane** out) { return create(out); }

void lw_plane_release(lw_plane* plane) {
  if (good(plane)) delete plane;
}

lw_status lw_plane_copy(const lw_plane* plane, lw_plane* into) {
  return fill(plane, into, [](const PlaneAppearance& p) { return p; });
}

lw_status lw_plane_get_info(const lw_plane* plane, lw_plane_info* out) {
  return with_handle(plane, [&](const PlaneAppearance& p) { return write_sized(as_c(p), "lw_plane_info", out); });
}

lw_status lw_plane_radiance(const lw_plane* plane, const double* point, const double* eye, lw_plane_layers layers,
                            lw_plane_answer* out) {
  return plane_query(plane, out, [&](const PlaneAppearance& p) -> Status {
    if (point == nullptr) return null_argument("point");
    if (eye == nullptr) return null_argument("eye");
    PlaneLayers wanted{};
    if (Status s = layers_of(layers, wanted); !s.ok()) return s;
    return write_answer(p, p.radiance({point[0], point[1]}, vector_at(eye), wanted), out);
  });
}

lw_status lw_plane_diffuse(const lw_plane* plane, const double* point, lw_plane_answer* out) {
  return plane_query(plane, out, [&](const PlaneAppearance& p) -> Status {
    if (point == nullptr) return null_argument("point");
    return write_answer(p, p.diffuse({point[0], point[1]}), out);
  });
}

lw_status lw_plane_specular(const lw_plane* plane, const double* to_viewer, lw_plane_answer* out) {
  return plane_query(plane, out, [&](const PlaneAppearance& p) -> Status {
    if (to_viewer == nullptr) return null_argument("to_viewer");
    return write_answer(p, p.specular(vector_at(to_viewer)), out);
  });
}

lw_status lw_plane_render(const lw_plane* plane, const lw_plane_camera* camera, lw_plane_layers layers, float* rgb,
                          size_t rgb_count, uint8_t* flags, size_t flag_count, lw_plane_rendering* about) {
  const lw_status status = with_handle(plane, [&](const PlaneAppearance& p) -> Status {
    lw_plane_camera given{};
    if (Status s = read_sized(camera, "lw_plane_camera", given); !s.ok()) return s;
    PlaneLayers wanted{};
    if (Status s = layers_of(layers, wanted); !s.ok()) return s;
    if (rgb == nullptr && rgb_count > 0) return null_argument("rgb");
    if (flags == nullptr && flag_count > 0) return null_argument("flags");
    lw_plane_rendering out{};
    // Written before the pixels, so that an invalid struct is detected before anything is written.
    if (about != nullptr)
      if (Status s = write_sized(out, "lw_plane_rendering", about); !s.ok()) return s;
    const PlaneCamera made{
        given.width, given.height, given.fx, given.fy, given.cx, given.cy, pose_of(given.position, given.orientation)};
    const PlaneRendering done = p.render(made, wanted, {rgb, rgb_count}, {flags, flag_count});
    out.validity = static_cast<lw_validity>(done.validity);
    out.flags = done.flags.bits();
    out.pixels = done.pixels;
    out.flagged = done.flagged;
    return about == nullptr ? Status{} : write_sized(out, "lw_plane_rendering", about);
  });
  return write_failure(status, "lw_plane_rendering", about);
}

lw_status lw_plane_get_guidance(const lw_plane* plane, const lw_plane_guidance_options* options,
                                lw_plane_guidance* out) {
  return with_handle(plane, [&](const PlaneAppearance& p) -> Status {
    PlaneGuidanceOptions wanted;
    if (options != nullptr) {
      lw_plane_guidance_options given{};
      if (Status s = read_sized(options, "lw_plane_guidance_options", given); !s.ok()) return s;
      if (given.min_elevation != 0) wanted.min_elevation_rad = given.min_elevation;
      if (given.min_seen != 0) wanted.min_seen = given.min_seen;
      if (given.max_gap != 0) wanted.max_gap_rad = given.max_gap;
    }
    const PlaneGuidance guidance = p.guidance(wanted);
    lw_plane_guidance made{};
    made.progress = static_cast<std::int32_t>(guidance.progress);
    made.seen = guidance.seen;
    made.gap = guidance.gap_rad;
    put(guidance.next.value_or(Vec3d{}), made.next);
    put(probe_direction(p.info()).value_or(Vec3d{}), made.probe);
    made.circle = guidance_disc_radius(wanted);
    return write_sized(made, "lw_plane_guidance", out);
  });
}

lw_status lw_plane_coverage(const lw_plane* plane, float* xy, uint8_t* seen, size_t capacity, size_t* count) {
  return with_handle(plane, [&](const PlaneAppearance& p) -> Status {
    if (capacity > 0 && (xy == nullptr || seen == nullptr)) return null_argument("xy or seen");
    const PlaneCoverage& coverage = p.coverage();
    for (std::size_t n = 0; n < std::min(capacity, coverage.grid.size()); ++n) {
      const DiscPoint point = stereographic(coverage.grid.direction(n));
      xy[2 * n] = static_cast<float>(point.x);
      xy[2 * n + 1] = static_cast<float>(point.y);
      seen[n] = coverage.seen[n];
    }
    if (count != nullptr) *count = coverage.grid.size();
    return {};
  });
}

}  // extern "C"
