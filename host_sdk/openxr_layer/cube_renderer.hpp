// Cube maps of the light, computed by a thread of their own: one takes longer than a frame may.
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include <lightwell/cube_map.h>
#include <lightwell/geometry.hpp>

#include "android_light_estimation.h"
#include "light_source.hpp"

namespace lightwell::xr {

/// For one light estimator. Follows the newest light, every 0.1 s at most, as long as maps are requested: until two
/// seconds after the last request.
class CubeRenderer {
 public:
  static constexpr std::array<std::uint32_t, 4> kResolutions{32, 16, 64, 8};
  static constexpr std::array<XrCubemapLightingColorFormatANDROID, 3> kFormats{
      XR_CUBEMAP_LIGHTING_COLOR_FORMAT_R16G16B16A16_SFLOAT_ANDROID,
      XR_CUBEMAP_LIGHTING_COLOR_FORMAT_R32G32B32A32_SFLOAT_ANDROID,
      XR_CUBEMAP_LIGHTING_COLOR_FORMAT_R32G32B32_SFLOAT_ANDROID};

  /// `info` has one of these resolutions and formats. `source` outlives this. Null if there is no memory.
  [[nodiscard]] static std::unique_ptr<CubeRenderer> make(const XrCubemapLightEstimatorCreateInfoANDROID& info,
                                                          const LightSource& source, float scale);
  ~CubeRenderer();
  CubeRenderer(const CubeRenderer&) = delete;
  CubeRenderer& operator=(const CubeRenderer&) = delete;

  /// Requests maps for light in the axes of T_space_probe, and copies the newest one into the buffers of `out`. Sets
  /// rotation and state: INVALID where there is no map yet, where it is older than kMaxMapAgeNs, where the space has
  /// turned since by more than a degree (reprojected maps), and where the buffers are too small. Returns the map's
  /// mid-exposure in the host's clock, 0 if INVALID. Does not wait for the computation of a map.
  std::int64_t copy(const Pose& T_space_probe, XrCubemapLightingDataANDROID& out);

  [[nodiscard]] std::size_t face_bytes() const;

 private:
  static constexpr std::int64_t kMaxMapAgeNs = 1'000'000'000;
  struct Release {
    void operator()(lw_lighting* lighting) const { lw_lighting_release(lighting); }
  };

  CubeRenderer(const XrCubemapLightEstimatorCreateInfoANDROID& info, const LightSource& source, float scale);
  void run();
  /// Computes the map of the newest light into back_; 0 if there is no light.
  [[nodiscard]] std::int64_t render(const Pose& T_space_probe);
  void write_face(std::size_t face, std::uint8_t* to) const;

  const XrCubemapLightEstimatorCreateInfoANDROID info_;
  const LightSource& source_;
  const float scale_;
  std::unique_ptr<lw_lighting, Release> light_;  ///< Of the thread.
  std::vector<std::byte> back_;                  ///< Of the thread.

  std::mutex mutex_;
  std::condition_variable wake_;
  enum class Phase { running, stopping } phase_ = Phase::running;
  std::optional<Pose> requested_;  ///< T_space_probe of the last request.
  std::chrono::steady_clock::time_point requested_at_{};
  std::vector<std::byte> front_;  ///< The newest map, faces +X, -X, +Y, -Y, +Z, -Z.
  Pose front_pose_;               ///< T_space_probe of it.
  std::int64_t front_ns_ = 0;     ///< Its mid-exposure; 0: none.
  std::thread thread_;            ///< Last: it uses the others.
};

}  // namespace lightwell::xr
