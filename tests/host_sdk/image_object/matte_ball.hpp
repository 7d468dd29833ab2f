// Pictures of a matte or glossy ball under a row of lights, in closed form.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/image_object.hpp>
#include <lightwell/image_object_encoder.hpp>

namespace lightwell::test {

/// A textured ball that fills a square picture.
struct Ball {
  static constexpr int kSide = 40;

  ObjectRig rig;
  std::vector<Radiance> ambient = std::vector<Radiance>(kSide * kSide);
  std::vector<std::vector<Radiance>> lit;
  std::vector<std::uint8_t> coverage = std::vector<std::uint8_t>(kSide * kSide);
  float gloss = 0;  ///< Peak of a white highlight.

  /// Lights on the semicircle in front, from the right to the left.
  explicit Ball(int lights = 21, float highlight = 0) : gloss(highlight) {
    rig.columns = rig.rows = kSide;
    rig.turns_rad = {0};
    rig.camera_distance_m = 5;
    rig.half_width_m = 1;
    for (int i = 0; i < lights; ++i) rig.light_positions.push_back(on_arc(lights > 1 ? 1.0 * i / (lights - 1) : 0.5));
    for (int p = 0; p < kSide * kSide; ++p) {
      const Vec3d n = normal(p);
      if (n.z <= 0) continue;
      coverage[static_cast<std::size_t>(p)] = 255;
      ambient[static_cast<std::size_t>(p)] = albedo(n) * 0.5F;
    }
    for (const Vec3f& position : rig.light_positions) lit.push_back(picture(position));
  }

  /// 0: right, 0.5: from the camera and above, 1: left.
  static Vec3f on_arc(double share) {
    const double angle = std::numbers::pi * share;
    return {static_cast<float>(std::cos(angle)), static_cast<float>(0.4 * std::sin(angle)),
            static_cast<float>(std::sin(angle))};
  }

  /// z is not above 0 beside the ball.
  static Vec3d normal(int pixel) {
    const double x = (pixel % kSide + 0.5) / kSide * 2.2 - 1.1, y = 1.1 - (pixel / kSide + 0.5) / kSide * 2.2;
    const double z2 = 1 - x * x - y * y;
    return {x, y, z2 > 0 ? std::sqrt(z2) : 0};
  }

  static Radiance albedo(Vec3d n) {
    const auto stripe = static_cast<float>(0.5 + 0.4 * std::sin(9 * n.y + 5 * n.x));
    return {0.8F * stripe, 0.35F, 0.2F + 0.3F * stripe};
  }

  [[nodiscard]] std::vector<Radiance> picture(Vec3f towards) const {
    const Vec3d l = normalized(vec_cast<double>(towards));
    std::vector<Radiance> out(kSide * kSide);
    for (int p = 0; p < kSide * kSide; ++p) {
      const Vec3d n = normal(p);
      if (n.z <= 0) continue;
      const double half = dot(n, normalized(l + Vec3d{0, 0, 1}));
      const auto white = static_cast<float>(dot(n, l) > 0 ? gloss * std::pow(std::max(0.0, half), 80) : 0);
      out[static_cast<std::size_t>(p)] =
          albedo(n) * static_cast<float>(std::max(0.0, dot(n, l))) + Radiance{white, white, white};
    }
    return out;
  }

  [[nodiscard]] ViewPictures pictures() const {
    ViewPictures out;
    for (const auto& picture : lit) out.lit.emplace_back(picture);
    out.ambient = ambient;
    out.coverage = coverage;
    return out;
  }
};

inline constexpr ObjectEncoderOptions kFine{0.002F, 0.002F, 0.002F};

inline std::string encoded(const Ball& ball, const ObjectEncoderOptions& options = kFine) {
  const auto view = encode_view(ball.rig, ball.pictures(), options);
  EXPECT_TRUE(view.ok()) << view.status().message();
  return view.ok() ? *view : std::string();
}

/// The file of a data set whose views are all that of the ball.
inline std::string file_of(const Ball& ball, const ObjectEncoderOptions& options = kFine) {
  const std::vector<std::string> views(ball.rig.turns_rad.size(), encoded(ball, options));
  const auto file = make_image_object(ball.rig, views);
  EXPECT_TRUE(file.ok()) << file.status().message();
  return file.ok() ? *file : std::string();
}

inline ObjectView view_of(const Ball& ball, const ObjectEncoderOptions& options = kFine) {
  const auto object = ImageObject::from_bytes(file_of(ball, options));
  EXPECT_TRUE(object.ok()) << object.status().message();
  const auto view = object->view(0);
  EXPECT_TRUE(view.ok()) << view.status().message();
  return *view;
}

inline std::vector<Radiance> relit(const ObjectView& view, const std::vector<ObjectLight>& lights,
                                   LightInterpolation interpolation = LightInterpolation::smooth) {
  ObjectRelighter relighter;
  std::vector<Radiance> out(view.coverage().size());
  const auto done = relighter.relight(view, lights, interpolation, out);
  EXPECT_TRUE(done.ok()) << done.status().message();
  return out;
}

/// RMS difference of all channels.
inline double rms(const std::vector<Radiance>& a, const std::vector<Radiance>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (int c = 0; c < 3; ++c) sum += std::pow(static_cast<double>(a[i][c] - b[i][c]), 2);
  return std::sqrt(sum / (3 * static_cast<double>(a.size())));
}

}  // namespace lightwell::test
