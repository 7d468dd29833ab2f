// Re-rendering of captured planes against closed forms and an independent computation in double precision.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include <lightwell/plane_appearance.hpp>
#include <lightwell/plane_codec.hpp>

#include "support/captured_planes.hpp"

namespace lightwell {
namespace {

using test::linear_diffuse;
using test::linear_plane;
using test::linear_specular;

constexpr PlaneEncoderOptions kWithImages{.images = ImageRecipients::all_clients};
constexpr HostTime kNow{1'000'000'000};

PlaneAppearance received(const CapturedPlane& plane, const PlaneEncoderOptions& options = kWithImages) {
  PlaneEncoder encoder(options);
  PlaneReader reader;
  const auto messages = encoder.encode(plane, plane.info.mid_exposure);
  EXPECT_TRUE(messages.ok()) << messages.status().message();
  for (const auto& bytes : *messages) EXPECT_TRUE(reader.take(bytes, kNow).ok());
  return reader.snapshot(kNow);
}

/// RGB9E5's half step, relative to the largest channel of a colour.
double rounding(const Radiance& v) { return static_cast<double>(std::max({v.r, v.g, v.b})) / 512; }

void expect_near(const Radiance& value, const Radiance& truth, double tolerance) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(value[c], truth[c], tolerance) << c;
}

/// The unit vector at these angles.
Vec3d direction(double theta, double phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

TEST(PlaneAppearance, OfNothingHasNoAnswer) {
  const PlaneAppearance none;
  EXPECT_EQ(none.validity(), Validity::none);
  EXPECT_EQ(none.radiance({}, {0, 0, 1}).validity, Validity::none);
  EXPECT_EQ(none.specular({0, 0, 1}).validity, Validity::none);
  EXPECT_EQ(none.info().capture, 0U);
  EXPECT_EQ(none.guidance().seen, 0);
  std::vector<float> rgb(3, 7.0F);
  EXPECT_EQ(none.render({1, 1, 1, 1, 0, 0, {{}, {0, 0, 1}}}, PlaneLayers::all, rgb).validity, Validity::none);
  EXPECT_EQ(rgb[0], 7);
  PlaneReader reader;
  EXPECT_EQ(reader.snapshot(kNow).validity(), Validity::none);
}

/// D and S of linear_plane() are linear where the interpolation is: what is left are the roundings of the wire and of
/// float.
TEST(PlaneAppearance, RadianceIsThatOfTheClosedForm) {
  const PlaneAppearance plane = received(linear_plane());
  ASSERT_EQ(plane.validity(), Validity::valid);
  std::mt19937 random(1);
  // Between the centres of the outermost texels.
  std::uniform_real_distribution<double> inside(-0.0984, 0.0984), angle(0, 2 * std::numbers::pi),
      elevation(0, std::numbers::pi / 2 - 0.01), distance(0.05, 3);
  for (int k = 0; k < 2000; ++k) {
    const PlanePoint p{inside(random), inside(random)};
    const double theta = elevation(random);
    const Vec3d to_eye = direction(theta, angle(random)) * distance(random);
    const PlaneAnswer answer = plane.radiance(p, Vec3d{p.x, p.y, 0} + to_eye);
    ASSERT_EQ(answer.validity, Validity::valid);
    EXPECT_FALSE(answer.flags.any());
    const Radiance d = linear_diffuse(p.x, p.y), s = linear_specular(theta);
    expect_near(answer.value, d + s, rounding(d) + rounding(s) + 1e-4);
    expect_near(plane.diffuse(p).value, d, rounding(d) + 1e-5);
    expect_near(plane.specular(to_eye).value, s, rounding(s) + 1e-4);
    expect_near(plane.radiance(p, Vec3d{p.x, p.y, 0} + to_eye, PlaneLayers::specular).value, s, rounding(s) + 1e-4);
  }
  // Beyond the outermost centres the texture is constant.
  EXPECT_EQ(plane.diffuse({0.1, 0}).value, plane.diffuse({0.0985, 0}).value);
}

/// Random texels and nodes, computed again: by the four nearest texel centres, and by the corners of the triangle of
/// the lattice that contains the angles of the direction.
class DoubleAppearance {
 public:
  explicit DoubleAppearance(const CapturedPlane& plane) : plane_(plane) {}

  [[nodiscard]] std::array<double, 3> diffuse(double x_m, double y_m) const {
    const int edge = plane_.texture.edge;
    const double pitch = plane_.info.size_m / edge;
    std::array<double, 3> out{};
    for (int j = 0; j < edge; ++j)
      for (int i = 0; i < edge; ++i) {
        const double dx = std::abs(x_m - (i + 0.5 - edge / 2.0) * pitch) / pitch;
        const double dy = std::abs(y_m - (edge / 2.0 - j - 0.5) * pitch) / pitch;
        const double w = std::max(0.0, 1 - dx) * std::max(0.0, 1 - dy);
        const Radiance& v = plane_.texture.radiance[static_cast<std::size_t>(j * edge + i)];
        for (int c = 0; c < 3; ++c) out[static_cast<std::size_t>(c)] += w * static_cast<double>(v[c]);
      }
    return out;
  }

  /// Level i of n is at theta = i pi / (2 n) and has 4 i nodes, numbered after those of the levels above. In a quarter,
  /// with u = (levels from the pole) and v = u times the share of the quarter, nodes are at whole u and v, and the
  /// triangles have the corners (a, b), (a + 1, b), (a + 1, b + 1) and (a, b), (a, b + 1), (a + 1, b + 1).
  [[nodiscard]] std::array<double, 3> specular(double theta, double phi) const {
    const int n = plane_.lumisphere.grid.levels();
    const double u = theta / (std::numbers::pi / 2) * n;
    const int quarter = static_cast<int>(phi / (std::numbers::pi / 2));
    const double v = (phi / (std::numbers::pi / 2) - quarter) * u;
    const int a = static_cast<int>(std::floor(u)), b = static_cast<int>(std::floor(v));
    const double fu = u - a, fv = v - b;
    std::array<double, 3> out{};
    const auto add = [&](int level, int along, double w) {
      std::size_t node = 0;
      if (level > 0) {
        for (int k = 1; k < level; ++k) node += static_cast<std::size_t>(4 * k);
        node += 1 + static_cast<std::size_t>((quarter * level + along) % (4 * level));
      }
      for (int c = 0; c < 3; ++c)
        out[static_cast<std::size_t>(c)] += w * static_cast<double>(plane_.lumisphere.radiance[node][c]);
    };
    if (fu >= fv) {
      add(a, b, 1 - fu);
      add(a + 1, b, fu - fv);
      add(a + 1, b + 1, fv);
    } else {
      add(a, b, 1 - fv);
      add(a, b + 1, fv - fu);
      add(a + 1, b + 1, fu);
    }
    return out;
  }

 private:
  const CapturedPlane& plane_;
};

CapturedPlane random_plane() {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> uniform;
  CapturedPlane plane = linear_plane(40, 16, 8);
  for (auto* list : {&plane.texture.radiance, &plane.lumisphere.radiance})
    for (Radiance& v : *list) v = {uniform(random), uniform(random), uniform(random)};
  plane.info.texture_to_plane = {0.004, -0.003, 0.05, 1.02};
  return plane;
}

TEST(PlaneAppearance, RadianceIsThatOfTheDoubleComputation) {
  const CapturedPlane truth = random_plane();
  const DoubleAppearance oracle(truth);
  const PlaneAppearance plane = received(truth);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> inside(-0.097, 0.097), angle(0, 2 * std::numbers::pi), elevation(0.01, 1.55);
  for (int k = 0; k < 1000; ++k) {
    const double x = inside(random), y = inside(random), theta = elevation(random), phi = angle(random);
    // The point of the texture, moved to the plane: rotated by 0.05 rad, scaled by 1.02, shifted.
    const double c = 1.02 * std::cos(0.05), s = 1.02 * std::sin(0.05);
    const PlanePoint p{c * x - s * y + 0.004, s * x + c * y - 0.003};
    const auto d = oracle.diffuse(x, y), g = oracle.specular(theta, phi);
    const PlaneAnswer answer = plane.radiance(p, Vec3d{p.x, p.y, 0} + direction(theta, phi) * 0.4);
    ASSERT_EQ(answer.validity, Validity::valid);
    for (int i = 0; i < 3; ++i)
      // Both are rounded to nine bits of at most 1; the angles of a float are 3e-6 quarter turns off, times 16 nodes.
      EXPECT_NEAR(answer.value[i], d[static_cast<std::size_t>(i)] + g[static_cast<std::size_t>(i)], 2.0 / 512 + 1e-4);
  }
}

/// A camera above the plane, looking at its middle, from a direction and a distance.
PlaneCamera camera_at(double theta, double phi, double distance, int width, int height) {
  const Vec3d eye = direction(theta, phi) * distance, back = normalized(eye);
  const Vec3d right = normalized(cross(std::abs(back.y) < 0.9 ? Vec3d{0, 1, 0} : Vec3d{1, 0, 0}, back));
  const Vec3d up = cross(back, right);
  // The quaternion of the matrix with the columns right, up, back.
  const double w = std::sqrt(std::max(0.0, 1 + right.x + up.y + back.z)) / 2;
  const Quat q{(up.z - back.y) / (4 * w), (back.x - right.z) / (4 * w), (right.y - up.x) / (4 * w), w};
  return {width, height, 1.2 * width, 1.3 * width, width / 2.0 - 3, height / 2.0 + 2, {q.normalized(), eye}};
}

TEST(PlaneAppearance, RenderedPixelsAreTheRadianceOfTheirRays) {
  const CapturedPlane truth = random_plane();
  const PlaneAppearance plane = received(truth);
  for (const double theta : {0.1, 0.8, 1.35}) {
    const PlaneCamera camera = camera_at(theta, 0.7, 0.5, 64, 48);
    std::vector<float> rgb(3 * 64 * 48, -1.0F);
    std::vector<std::uint8_t> flags(64 * 48, 0x55);
    const PlaneRendering done = plane.render(camera, PlaneLayers::all, rgb, flags);
    EXPECT_EQ(done.validity, Validity::valid);
    EXPECT_EQ(done.flagged, 0U);
    std::size_t written = 0;
    for (int row = 0; row < 48; ++row)
      for (int column = 0; column < 64; ++column) {
        const auto pixel = static_cast<std::size_t>(row * 64 + column);
        // The point of the plane that projects to this pixel, by Cramer's rule on the two equations of the projection.
        const Vec3d& eye = camera.T_plane_camera.translation;
        const Quat& q = camera.T_plane_camera.rotation;
        const double u = (column - camera.cx) / camera.fx, v = (row - camera.cy) / camera.fy;
        const Vec3d right = rotate(q, Vec3d{1, 0, 0}), up = rotate(q, Vec3d{0, 1, 0}), back = rotate(q, Vec3d{0, 0, 1});
        // right·(p - e) = -u back·(p - e), up·(p - e) = v back·(p - e).
        const Vec3d a = right + back * u, b = up - back * v;
        const double ra = dot(a, eye), rb = dot(b, eye), det = a.x * b.y - a.y * b.x;
        const PlanePoint p{(ra * b.y - a.y * rb) / det, (a.x * rb - ra * b.x) / det};
        const PlaneAnswer answer = plane.radiance(p, eye);
        const bool in_front = dot(back, Vec3d{p.x, p.y, 0} - eye) < 0;
        if (answer.validity == Validity::valid && in_front) {
          ++written;
          EXPECT_EQ(flags[pixel], 0);
          // Interpolation of random texels of 5 mm turns a position that differs by 1e-10 m into 1e-7.
          for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(rgb[3 * pixel + static_cast<std::size_t>(c)], answer.value[c], 2e-4) << column << " " << row;
        } else {
          EXPECT_EQ(rgb[3 * pixel], -1) << column << " " << row;
          EXPECT_EQ(flags[pixel], 0x55);
        }
      }
    EXPECT_EQ(done.pixels, written);
    EXPECT_GT(written, 100U);
    EXPECT_LT(written, 64U * 48) << "the camera sees more than the plane";
  }
}

TEST(PlaneAppearance, LayersOfAnImageAddUp) {
  const PlaneAppearance plane = received(random_plane());
  const PlaneCamera camera = camera_at(0.5, 2, 0.4, 32, 32);
  std::vector<float> all(3 * 32 * 32), diffuse(all), specular(all);
  (void)plane.render(camera, PlaneLayers::all, all);
  (void)plane.render(camera, PlaneLayers::diffuse, diffuse);
  (void)plane.render(camera, PlaneLayers::specular, specular);
  float most = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_NEAR(all[i], diffuse[i] + specular[i], 1e-6);
    most = std::max(most, specular[i]);
  }
  EXPECT_GT(most, 0.5F);
}

TEST(PlaneAppearance, FlagsTellWhatWasNotMeasured) {
  CapturedPlane truth = linear_plane();
  // A quarter of the texture, and one texel; directions at azimuths up to 180 degrees, and one level.
  for (std::size_t k = 0; k < truth.texture.count(); ++k)
    if (k % 64 < 32 && k / 64 < 32) truth.texture.state[k] = SampleState::unseen;
  truth.texture.state[64 * 40 + 40] = SampleState::clipped;
  for (std::size_t n = 0; n < truth.lumisphere.grid.size(); ++n) {
    if (truth.lumisphere.grid.direction(n).y > 0.01) truth.lumisphere.state[n] = SampleState::unseen;
    if (truth.lumisphere.grid.level_of(n) == 18) truth.lumisphere.state[n] = SampleState::clipped;
  }
  const PlaneAppearance plane = received(truth);
  const PlaneAnswer unseen = plane.diffuse({-0.05, 0.05});
  EXPECT_EQ(unseen.validity, Validity::valid);
  EXPECT_TRUE(unseen.flags.has(PlaneFlag::unseen_texel));
  EXPECT_EQ(unseen.value, Radiance{});
  // Between unseen and seen texels: the radiance of the seen ones. Column 32 begins at x = 0.
  const PlaneAnswer border = plane.diffuse({0, 0.05});
  EXPECT_TRUE(border.flags.has(PlaneFlag::unseen_texel));
  expect_near(border.value, linear_diffuse(0.0015625, 0.05), 0.002);
  EXPECT_FALSE(plane.diffuse({0.05, 0.05}).flags.any());
  EXPECT_TRUE(plane.diffuse({(40.5 / 64 - 0.5) * 0.2, (0.5 - 40.5 / 64) * 0.2}).flags.has(PlaneFlag::clipped_texel));
  const PlaneAnswer away = plane.specular(direction(0.9, 1.5));
  EXPECT_TRUE(away.flags.has(PlaneFlag::unseen_direction));
  expect_near(away.value, linear_specular(0.9), 0.005);
  EXPECT_FALSE(plane.specular(direction(0.9, 4.5)).flags.any());
  const double clipped_theta = 18 * std::numbers::pi / 40;
  EXPECT_TRUE(plane.specular(direction(clipped_theta, 4.5)).flags.has(PlaneFlag::clipped_direction));
  EXPECT_FALSE(plane.specular(direction(clipped_theta, 4.5)).flags.has(PlaneFlag::unseen_direction));
  const PlaneAnswer both = plane.radiance({-0.05, 0.05}, {-0.05, 1, 0.5});
  EXPECT_TRUE(both.flags.has(PlaneFlag::unseen_texel) && both.flags.has(PlaneFlag::unseen_direction));
  std::vector<float> rgb(3 * 64 * 64);
  std::vector<std::uint8_t> flags(64 * 64);
  const PlaneRendering done = plane.render(camera_at(0.1, 4.5, 0.4, 64, 64), PlaneLayers::diffuse, rgb, flags);
  EXPECT_TRUE(done.flags.has(PlaneFlag::unseen_texel));
  EXPECT_FALSE(done.flags.has(PlaneFlag::unseen_direction));
  EXPECT_NEAR(static_cast<double>(done.flagged) / static_cast<double>(done.pixels), 0.25, 0.03);
  EXPECT_EQ(static_cast<std::size_t>(std::ranges::count_if(flags, [](auto f) { return f != 0; })), done.flagged);
}

TEST(PlaneAppearance, InvalidQueriesHaveNoValue) {
  const PlaneAppearance plane = received(linear_plane());
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  for (const PlanePoint p : {PlanePoint{nan, 0}, {0, infinity}, {0.11, 0}, {0, -0.1001}, {1e300, 1e300}}) {
    EXPECT_EQ(plane.radiance(p, {0, 0, 1}).validity, Validity::invalid_query);
    EXPECT_EQ(plane.diffuse(p).value, Radiance{});
  }
  for (const Vec3d eye : {Vec3d{0, 0, 0}, {0, 0, -1}, {0, 0, nan}, {infinity, 0, 1}, {0, 0, infinity}}) {
    EXPECT_EQ(plane.radiance({}, eye).validity, Validity::invalid_query);
    EXPECT_EQ(plane.specular(eye).validity, Validity::invalid_query);
  }
  // Extreme and finite.
  EXPECT_EQ(plane.radiance({}, {1e300, 0, 1e300}).validity, Validity::valid);
  EXPECT_EQ(plane.specular({1e-300, 0, 1e-300}).validity, Validity::valid);
  expect_near(plane.specular({1e-300, 0, 1e-300}).value, linear_specular(std::numbers::pi / 4), 0.003);

  std::vector<float> rgb(3 * 8 * 8, 5.0F);
  const PlaneCamera good = camera_at(0.3, 1, 0.5, 8, 8);
  EXPECT_EQ(plane.render(good, PlaneLayers::all, rgb).validity, Validity::valid);
  std::ranges::fill(rgb, 5.0F);
  const auto refused = [&](auto change, std::size_t floats = 3 * 8 * 8, std::size_t flag_count = 0) {
    PlaneCamera camera = good;
    change(camera);
    std::vector<std::uint8_t> flags(flag_count);
    const PlaneRendering done = plane.render(camera, PlaneLayers::all, std::span(rgb).first(floats), flags);
    return done.validity == Validity::invalid_query && done.pixels == 0;
  };
  EXPECT_TRUE(refused([](PlaneCamera& c) { c.width = 0; }));
  EXPECT_TRUE(refused([](PlaneCamera& c) { c.height = -8; }));
  EXPECT_TRUE(refused([](PlaneCamera& c) { c.fx = 0; }));
  EXPECT_TRUE(refused([=](PlaneCamera& c) { c.fy = nan; }));
  EXPECT_TRUE(refused([=](PlaneCamera& c) { c.cx = infinity; }));
  EXPECT_TRUE(refused([](PlaneCamera& c) { c.T_plane_camera.rotation.w = 3; }));
  EXPECT_TRUE(refused([](PlaneCamera& c) { c.T_plane_camera.translation.z = -0.1; }));
  EXPECT_TRUE(refused([=](PlaneCamera& c) { c.T_plane_camera.translation.x = nan; }));
  EXPECT_TRUE(refused([](PlaneCamera&) {}, 3 * 8 * 8 - 1));
  EXPECT_TRUE(refused([](PlaneCamera&) {}, 3 * 8 * 8, 63));
  EXPECT_TRUE(std::ranges::all_of(rgb, [](float v) { return v == 5; }));
  // A camera whose rays overflow sees nothing.
  EXPECT_FALSE(refused([](PlaneCamera& c) { c.fx = c.fy = 1e-300; }));
}

TEST(PlaneAppearance, WithoutATextureThereIsOnlyTheSpecularPart) {
  const PlaneAppearance plane = received(linear_plane(), {});
  EXPECT_EQ(plane.validity(), Validity::valid);
  EXPECT_EQ(plane.texture_edge(), 0);
  EXPECT_EQ(plane.radiance({}, {0, 0, 1}).validity, Validity::none);
  EXPECT_EQ(plane.diffuse({}).validity, Validity::none);
  EXPECT_EQ(plane.specular({0, 0, 1}).validity, Validity::valid);
  expect_near(plane.radiance({}, {0, 0, 1}, PlaneLayers::specular).value, linear_specular(0), 0.001);
  std::vector<float> rgb(3 * 8 * 8, 5.0F);
  const PlaneCamera camera = camera_at(0.3, 1, 0.5, 8, 8);
  EXPECT_EQ(plane.render(camera, PlaneLayers::all, rgb).validity, Validity::none);
  EXPECT_TRUE(std::ranges::all_of(rgb, [](float v) { return v == 5; }));
  EXPECT_EQ(plane.render(camera, PlaneLayers::specular, rgb).validity, Validity::valid);
}

/// The smallest sizes.
TEST(PlaneAppearance, OneTexelAndOneLevel) {
  CapturedPlane truth = linear_plane(1, 1, 1);
  const PlaneAppearance plane = received(truth);
  EXPECT_EQ(plane.diffuse({0.1, -0.1}).validity, Validity::valid);
  expect_near(plane.diffuse({0.05, -0.1}).value, truth.texture.radiance[0], 0.001);
  expect_near(plane.specular({0, 0, 1}).value, truth.lumisphere.radiance[0], 0.001);
}

}  // namespace
}  // namespace lightwell
