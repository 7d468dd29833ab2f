// Images of analytic scenes, and estimates from them.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/calibration.hpp>
#include <lightwell/descriptor.hpp>
#include <lightwell/query.hpp>

#include "calibration/model/lens_table.hpp"
#include "estimate/panorama/panorama_estimator.hpp"
#include "reference/irradiance.hpp"
#include "reference/vector.hpp"
#include "sim/sensor.hpp"

namespace lightwell::testing_scenes {

using RadianceOf = std::function<Radiance(Vec3d)>;

/// A frame that owns its float images, one per lens.
struct Picture {
  std::vector<std::vector<float>> pixels;
  Frame frame;
};

inline RigParameters rig_of(const char* kind, int width, int height, PixelFormat format = PixelFormat::rgb_f32) {
  Result<RigParameters> rig = sim::make_rig(kind, width, height, format);
  EXPECT_TRUE(rig.ok()) << rig.status().message();
  return *rig;
}

/// Sets every pixel of the rig to the scene's radiance at its middle.
inline Picture picture_of(const RigParameters& rig, const RadianceOf& scene) {
  Picture out;
  const Result<RigTable> table = make_rig_table(rig);
  EXPECT_TRUE(table.ok());
  out.frame.info.exposure_s = 1;
  for (std::size_t k = 0; k < rig.lenses.size(); ++k) {
    const LensTable& lens = table->lenses[k];
    std::vector<float>& pixels = out.pixels.emplace_back(3 * lens.direction.size());
    for (std::size_t i = 0; i < lens.direction.size(); ++i) {
      if (!(lens.solid_angle[i] > 0)) continue;
      const Radiance l = scene(vec_cast<double>(lens.direction[i]));
      pixels[3 * i] = l.r, pixels[3 * i + 1] = l.g, pixels[3 * i + 2] = l.b;
    }
  }
  for (std::size_t k = 0; k < rig.lenses.size(); ++k) {
    const LensParameters& lens = rig.lenses[k];
    out.frame.add_view({static_cast<int>(k), PixelFormat::rgb_f32, lens.width, lens.height,
                        packed_stride(PixelFormat::rgb_f32, lens.width), std::as_bytes(std::span(out.pixels[k]))});
  }
  return out;
}

/// All bands and lights (epsilon 0): for tests of the integration, without the selection.
inline EstimatorConfig everything(int band = 4, int max_lights = 8) {
  EstimatorConfig config;
  config.panorama.epsilon = 0;
  config.band = band;
  config.max_lights = max_lights;
  return config;
}

inline std::unique_ptr<Estimator> estimator_of(const RigParameters& rig, EstimatorConfig config = everything()) {
  PanoramaOptions options;
  options.config = config;
  Result<std::unique_ptr<Estimator>> made = make_panorama_estimator(rig, options);
  EXPECT_TRUE(made.ok()) << made.status().message();
  return std::move(*made);
}

inline Descriptor estimated(Estimator& estimator, const Picture& picture) {
  Descriptor d;
  const Status s = estimator.estimate(std::span(&picture.frame, 1), d);
  EXPECT_TRUE(s.ok()) << s.message();
  return d;
}

inline Descriptor estimated(const RigParameters& rig, const RadianceOf& scene, EstimatorConfig config = everything()) {
  return estimated(*estimator_of(rig, config), picture_of(rig, scene));
}

/// The larger of the two relative RMS errors of irradiance (plain, luminance-weighted).
inline double error_of(const Descriptor& d, const std::function<Irradiance(Vec3d)>& truth) {
  std::vector<reference::Rgb> expected, got;
  for (const reference::V3& n : reference::fibonacci_normals(2048)) {
    const Irradiance t = truth({n.x, n.y, n.z});
    const Irradiance e = irradiance_at(d, vec_cast<float>(Vec3d{n.x, n.y, n.z}));
    expected.push_back({t.r, t.g, t.b});
    got.push_back({e.r, e.g, e.b});
  }
  const reference::IrradianceError e = reference::irradiance_error(expected, got);
  return std::max(e.rms, e.luminance_weighted);
}

inline double degrees_between(Vec3f a, Vec3d b) {
  return angle_between(vec_cast<double>(a), b) * 180 / 3.14159265358979;
}

/// A disc of uniform radiance on a dim, slightly coloured sphere.
inline RadianceOf lamp(Vec3d direction, double radius_rad, float radiance, float ambient = 1) {
  const Vec3d axis = normalized(direction);
  const double edge = std::cos(radius_rad);
  return [=](Vec3d d) {
    const float l = dot(d, axis) >= edge ? radiance : 0;
    return Radiance{ambient + l, 0.9F * ambient + l, 0.8F * ambient + 0.5F * l};
  };
}

}  // namespace lightwell::testing_scenes
