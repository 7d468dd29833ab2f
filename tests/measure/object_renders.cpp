#include "measure/object_renders.hpp"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <span>

#include <lightwell/bytes.hpp>
#include <lightwell/files.hpp>

namespace lightwell::measure {
namespace {

using reference::PixelLight;
using reference::RigLight;

std::vector<RigLight> lights_of(double angular_radius_deg) {
  std::vector<RigLight> out;
  const double radius = angular_radius_deg * reference::pi / 180;
  for (int i = 0; i < kLights; ++i) out.push_back({reference::arc_direction(kLightStepDeg * i), radius});
  for (int j = 0; j < kBetween; ++j)
    out.push_back({reference::arc_direction(kLightStepDeg * (light_before(j) + 0.5)), radius});
  return out;
}

Vec3f vector_of(const reference::V3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

RenderedView render(const reference::ObjectRenderer& renderer, const RenderedSet& set) {
  const double turn = kTurnStepDeg * set.view * reference::pi / 180;
  const auto view = renderer.render({turn, set.side, set.samples}, lights_of(set.angular_radius_deg));
  RenderedView out;
  const auto colours = [](const std::vector<std::array<float, 3>>& in) {
    std::vector<Radiance> rgb;
    rgb.reserve(in.size());
    for (const auto& p : in) rgb.push_back({p[0], p[1], p[2]});
    return rgb;
  };
  for (const float c : view.coverage) out.coverage.push_back(static_cast<std::uint8_t>(std::lround(255 * c)));
  out.ambient = colours(view.ambient);
  for (const auto& picture : view.pictures) {
    out.lit.push_back(colours(picture.rgb));
    out.light.push_back(picture.light);
  }
  return out;
}

/// Calls use(memory, bytes) for each array of a view, in the order of the file.
template <class View, class Use>
void each_array(View& view, const Use& use) {
  use(view.coverage.data(), view.coverage.size());
  use(view.ambient.data(), view.ambient.size() * sizeof(Radiance));
  for (auto& picture : view.lit) use(picture.data(), picture.size() * sizeof(Radiance));
  for (auto& picture : view.light) use(picture.data(), picture.size() * sizeof(PixelLight));
}

/// CRC of a small render of the scene.
std::uint32_t fingerprint(const reference::ObjectRenderer& renderer) {
  const RenderedView small = render(renderer, {2, 24, 2, 1});
  std::uint32_t crc = 0;
  each_array(small, [&](const void* data, std::size_t bytes) {
    crc = crc32c(std::span(static_cast<const std::byte*>(data), bytes), crc);
  });
  return crc;
}

}  // namespace

ViewPictures RenderedView::pictures() const {
  ViewPictures out;
  for (int i = 0; i < kLights; ++i) out.lit.emplace_back(lit[static_cast<std::size_t>(i)]);
  out.ambient = ambient;
  out.coverage = coverage;
  return out;
}

ObjectRig reference_rig(int side) {
  ObjectRig rig;
  rig.columns = rig.rows = side;
  for (int i = 0; i < kLights; ++i)
    rig.light_positions.push_back(vector_of(reference::arc_direction(kLightStepDeg * i)));
  for (int v = 0; v < kViews; ++v) rig.turns_rad.push_back(static_cast<float>(kTurnStepDeg * v * reference::pi / 180));
  rig.camera_distance_m = static_cast<float>(reference::ObjectRenderer::kCameraDistance);
  rig.half_width_m = static_cast<float>(reference::ObjectRenderer::kHalfWidth);
  return rig;
}

Vec3f between_direction(int j) { return vector_of(reference::arc_direction(kLightStepDeg * (light_before(j) + 0.5))); }

Result<RenderedView> rendered_view(const reference::ObjectRenderer& renderer, const RenderedSet& set,
                                   const std::string& folder) {
  if (folder.empty()) return render(renderer, set);
  std::error_code error;
  std::filesystem::create_directories(path_of(folder), error);
  char name[96];
  std::snprintf(name, sizeof name, "/%08x_view%d_%d_%d_%g.raw", fingerprint(renderer), set.view, set.side, set.samples,
                set.angular_radius_deg);
  const std::string path = folder + name;
  RenderedView out;
  const std::size_t pixels = static_cast<std::size_t>(set.side) * static_cast<std::size_t>(set.side);
  if (const auto file = read_text_file(path); file.ok()) {
    out.coverage.resize(pixels);
    out.ambient.resize(pixels);
    out.lit.assign(kLights + kBetween, std::vector<Radiance>(pixels));
    out.light.assign(kLights + kBetween, std::vector<PixelLight>(pixels));
    std::size_t at = 0;
    each_array(out, [&](void* data, std::size_t bytes) {
      if (at + bytes <= file->size()) std::memcpy(data, file->data() + at, bytes);
      at += bytes;
    });
    if (at == file->size()) return out;
  }
  out = render(renderer, set);
  std::string bytes;
  each_array(out, [&](const void* data, std::size_t size) { bytes.append(static_cast<const char*>(data), size); });
  if (const Status written = write_atomically(path, bytes, FileMode::umask); !written.ok()) return written;
  return out;
}

}  // namespace lightwell::measure
