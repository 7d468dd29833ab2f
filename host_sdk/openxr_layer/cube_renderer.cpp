#include "cube_renderer.hpp"

#include <cmath>
#include <cstring>
#include <numbers>
#include <utility>

namespace lightwell::xr {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kInterval{100}, kRequestLifetime{2'000};
constexpr double kMaxTurn = std::numbers::pi / 180;

bool is_half(XrCubemapLightingColorFormatANDROID format) {
  return format == XR_CUBEMAP_LIGHTING_COLOR_FORMAT_R16G16B16A16_SFLOAT_ANDROID;
}

/// Bytes of a texel in the application's buffers.
std::size_t texel_bytes(XrCubemapLightingColorFormatANDROID format) {
  if (is_half(format)) return 8;
  return format == XR_CUBEMAP_LIGHTING_COLOR_FORMAT_R32G32B32A32_SFLOAT_ANDROID ? 16 : 12;
}

/// Bytes of a texel of lw_lighting_cube_map.
std::size_t rendered_texel_bytes(XrCubemapLightingColorFormatANDROID format) { return is_half(format) ? 8 : 16; }

/// Angle between two rotations, rad.
double angle(const Quat& a, const Quat& b) {
  const Quat turn = a.inverse() * b;
  return 2 * std::atan2(length(Vec3d{turn.x, turn.y, turn.z}), std::abs(turn.w));
}

}  // namespace

std::unique_ptr<CubeRenderer> CubeRenderer::make(const XrCubemapLightEstimatorCreateInfoANDROID& info,
                                                 const LightSource& source, float scale) {
  std::unique_ptr<CubeRenderer> out(new CubeRenderer(info, source, scale));
  lw_lighting* light = nullptr;
  if (lw_lighting_create(&light) != LW_OK) return nullptr;
  out->light_.reset(light);
  out->thread_ = std::thread([renderer = out.get()] { renderer->run(); });
  return out;
}

CubeRenderer::CubeRenderer(const XrCubemapLightEstimatorCreateInfoANDROID& info, const LightSource& source, float scale)
    : info_(info), source_(source), scale_(scale) {
  const std::size_t edge = info.cubemapResolution;
  back_.resize(6 * edge * edge * rendered_texel_bytes(info.colorFormat));
  front_.resize(back_.size());
}

CubeRenderer::~CubeRenderer() {
  {
    const std::lock_guard lock(mutex_);
    phase_ = Phase::stopping;
  }
  wake_.notify_all();
  if (thread_.joinable()) thread_.join();
}

std::size_t CubeRenderer::face_bytes() const {
  return std::size_t{info_.cubemapResolution} * info_.cubemapResolution * texel_bytes(info_.colorFormat);
}

std::int64_t CubeRenderer::copy(const Pose& T_space_probe, XrCubemapLightingDataANDROID& out) {
  out.state = XR_LIGHT_ESTIMATE_STATE_INVALID_ANDROID;
  const std::lock_guard lock(mutex_);
  requested_ = T_space_probe;
  requested_at_ = std::chrono::steady_clock::now();
  wake_.notify_all();
  if (front_ns_ == 0 || lw_now_ns() - front_ns_ > kMaxMapAgeNs || out.imageBufferSize < face_bytes()) return 0;
  const Quat& now = T_space_probe.rotation;
  if (info_.reproject && angle(now, front_pose_.rotation) > kMaxTurn) return 0;
  // The front of OpenXR is -Z.
  std::uint8_t* const buffers[] = {out.imageBufferRight,  out.imageBufferLeft, out.imageBufferTop,
                                   out.imageBufferBottom, out.imageBufferBack, out.imageBufferFront};
  for (std::size_t face = 0; face < 6; ++face) write_face(face, buffers[face]);
  out.rotation = {0, 0, 0, 1};
  if (!info_.reproject)
    out.rotation = {static_cast<float>(now.x), static_cast<float>(now.y), static_cast<float>(now.z),
                    static_cast<float>(now.w)};
  out.state = XR_LIGHT_ESTIMATE_STATE_VALID_ANDROID;
  return front_ns_;
}

void CubeRenderer::write_face(std::size_t face, std::uint8_t* to) const {
  const std::size_t rendered = rendered_texel_bytes(info_.colorFormat), wanted = texel_bytes(info_.colorFormat);
  const std::size_t texels = std::size_t{info_.cubemapResolution} * info_.cubemapResolution;
  const std::byte* const from = front_.data() + face * texels * rendered;
  if (rendered == wanted)
    std::memcpy(to, from, texels * wanted);
  else  // without alpha
    for (std::size_t i = 0; i < texels; ++i) std::memcpy(to + i * wanted, from + i * rendered, wanted);
}

std::int64_t CubeRenderer::render(const Pose& T_space_probe) {
  const LightSource::Connection source = source_.connection();
  lw_lighting* const light = light_.get();
  if (!source.probe || lw_probe_latest(source.probe.get(), light) != LW_OK) return 0;
  if (info_.reproject) {
    const auto& [q, p] = T_space_probe;
    const double position[] = {p.x, p.y, p.z}, rotation[] = {q.x, q.y, q.z, q.w};
    if (lw_lighting_in_world(light, position, rotation, light) != LW_OK) return 0;
  }
  lw_lighting_info about{};
  about.size = sizeof about;
  lw_cube_map_options options{};
  options.size = sizeof options;
  options.edge = static_cast<std::int32_t>(info_.cubemapResolution);
  options.format = is_half(info_.colorFormat) ? LW_CUBE_RGBA16F : LW_CUBE_RGBA32F;
  options.scale = scale_;
  if (lw_lighting_get_info(light, &about) != LW_OK || about.validity != LW_VALID) return 0;
  if (lw_lighting_cube_map(light, &options, back_.data(), back_.size(), nullptr) != LW_OK) return 0;
  return about.mid_exposure_ns;
}

void CubeRenderer::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [this] {
      return phase_ == Phase::stopping ||
             (requested_ && std::chrono::steady_clock::now() - requested_at_ < kRequestLifetime);
    });
    if (phase_ == Phase::stopping) return;
    const Pose pose = *requested_;
    lock.unlock();
    const std::int64_t rendered_ns = render(pose);
    lock.lock();
    if (rendered_ns != 0) {
      std::swap(front_, back_);
      front_pose_ = pose;
      front_ns_ = rendered_ns;
    }
    wake_.wait_for(lock, kInterval, [&] {
      return phase_ == Phase::stopping ||
             (info_.reproject && angle(requested_->rotation, front_pose_.rotation) > kMaxTurn && rendered_ns != 0);
    });
  }
}

}  // namespace lightwell::xr
