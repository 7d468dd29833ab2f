#include "measure/specular_truth.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include <lightwell/color.hpp>
#include <lightwell/lighting.hpp>

#include "measure/panorama_sums.hpp"
#include "reference/bright_region.hpp"

namespace lightwell::measure {
namespace {

class SequenceFinder final : public BodyFinder {
 public:
  explicit SequenceFinder(const SpecularSequence& sequence) : sequence_(sequence) {}
  void set_decimation(const FinderDecimation&) override {}
  Result<std::optional<DetectedBody>> find(const View&, const FrameInfo&) override {
    return std::optional<DetectedBody>({sequence_.tag_pose(frame_++), 4, false, std::nullopt});
  }

 private:
  const SpecularSequence& sequence_;
  int frame_ = 0;
};

}  // namespace

std::unique_ptr<BodyFinder> make_sequence_finder(const SpecularSequence& sequence) {
  return std::make_unique<SequenceFinder>(sequence);
}

GlossyPlane plane_of_sequence() {
  GlossyPlane out;
  out.name = "reference plane", out.side_m = SpecularSequence::kPlane_m, out.tag_size_m = 0.03;
  out.tags.push_back({0, {}});
  return out;
}

reference::Panorama surroundings(const SpecularSequence& sequence, int k) {
  const reference::PlaneTexture& albedo = sequence.scene(k).albedo;
  reference::Rgb plane{};
  for (std::size_t i = 0; i < albedo.rgb.size(); ++i)
    plane[i % 3] += albedo.rgb[i] / (static_cast<double>(albedo.rgb.size()) / 3);
  for (std::size_t c = 0; c < 3; ++c) plane[c] *= sequence.scene(k).irradiance[c] / reference::pi;
  reference::Panorama out = reference::cleaned(sequence.environment(k));
  for (int j = out.height / 2; j < out.height; ++j)
    for (int i = 0; i < out.width; ++i) reference::set_pixel(out, i, j, plane);
  return out;
}

Vec3f in_probe(const Descriptor& d, const reference::V3& world) {
  const reference::V3 p = reference::plane_from_world(world);
  return rotate(d.T_probe_origin.rotation,
                Vec3f{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
}

reference::V3 in_world(const Descriptor& d, Vec3f probe) {
  const Vec3f p = rotate(d.T_probe_origin.rotation.inverse(), probe);
  return reference::world_from_plane({static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z)});
}

IrradianceTruth IrradianceTruth::of(const reference::Panorama& surroundings) {
  const PanoramaSums sums(surroundings);
  IrradianceTruth out{reference::fibonacci_normals(256), {}};
  for (const reference::V3& n : out.normals) out.irradiance.push_back(sums.irradiance(n));
  return out;
}

double IrradianceTruth::error(const Descriptor& d) const {
  const Lighting light = Lighting::of(d);
  double squares = 0, whole = 0;
  for (std::size_t k = 0; k < normals.size(); ++k) {
    const Irradiance e = light.irradiance(in_probe(d, normals[k])).value;
    const double found[3] = {static_cast<double>(e.r), static_cast<double>(e.g), static_cast<double>(e.b)};
    for (std::size_t c = 0; c < 3; ++c) {
      squares += (found[c] - irradiance[k][c]) * (found[c] - irradiance[k][c]);
      whole += irradiance[k][c] * irradiance[k][c];
    }
  }
  return std::sqrt(squares / whole);
}

std::vector<TrueLight> true_lights(const reference::Panorama& blurred, double lobe_width_rad) {
  constexpr double kMinPeakToMean = 4;
  std::vector<TrueLight> all, out;
  for (const reference::BrightRegion& r : reference::bright_regions(blurred, 100)) {
    if (r.peak_to_mean < kMinPeakToMean) break;
    const bool apart = std::ranges::all_of(all, [&](const TrueLight& o) {
      return reference::dot(o.direction, r.direction) < std::cos(2 * lobe_width_rad);
    });
    const auto& e = r.vector_irradiance;
    if (apart) all.push_back({r.direction, luminance_of(e[0], e[1], e[2])});
  }
  std::ranges::sort(all, std::greater<>(), &TrueLight::irradiance);
  for (const TrueLight& light : all)
    if (light.irradiance >= 0.1 * all.front().irradiance) out.push_back(light);
  return out;
}

}  // namespace lightwell::measure
