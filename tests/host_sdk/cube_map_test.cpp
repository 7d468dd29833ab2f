// Cube maps: places of texels by OpenGL's table, means against a dense quadrature in double, energy of lights, formats.
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/cap.hpp>
#include <lightwell/cube_map.hpp>
#include <lightwell/pixel.hpp>
#include <lightwell/query.hpp>

#include "host_sdk/scenes.hpp"

namespace lightwell {
namespace {

using Cube = std::vector<std::array<float, 4>>;

CubeMapOptions options_of(int edge, LightsIncluded lights = LightsIncluded::yes) {
  return {edge, CubeFormat::rgba32f, lights, 1};
}

Cube cube_of(const Lighting& light, const CubeMapOptions& options) {
  Cube out(cube_map_bytes(options.edge, CubeFormat::rgba32f) / sizeof(Cube::value_type));
  EXPECT_EQ(cube_map(light, options, std::as_writable_bytes(std::span(out))).validity, light.validity());
  return out;
}

/// Face and texture coordinates of a direction: OpenGL 4.6, table 8.19 and equation 8.29.
struct Place {
  int face;
  double s, t;
};
Place opengl_place(const Vec3d& r) {
  const double x = std::abs(r.x), y = std::abs(r.y), z = std::abs(r.z);
  int face = 0;
  double sc = 0, tc = 0, ma = 0;
  if (x >= y && x >= z) {
    face = r.x > 0 ? 0 : 1, sc = r.x > 0 ? -r.z : r.z, tc = -r.y, ma = x;
  } else if (y >= z) {
    face = r.y > 0 ? 2 : 3, sc = r.x, tc = r.y > 0 ? r.z : -r.z, ma = y;
  } else {
    face = r.z > 0 ? 4 : 5, sc = r.z > 0 ? r.x : -r.x, tc = -r.y, ma = z;
  }
  return {face, (sc / ma + 1) / 2, (tc / ma + 1) / 2};
}
std::size_t texel_of(const Vec3d& d, int edge) {
  const Place p = opengl_place(d);
  const auto index = [edge](double s) { return std::min(static_cast<int>(s * edge), edge - 1); };
  return static_cast<std::size_t>((p.face * edge + index(p.t)) * edge + index(p.s));
}

/// Calls visit(texel, direction, solid angle) for n x n places of each texel, by OpenGL's table alone: the places are
/// those of the lattice points of six planes.
template <class Visit>
void for_each_place(int edge, int n, const Visit& visit) {
  const double step = 2.0 / (edge * n);
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0})
      for (int i = 0; i < edge * n; ++i)
        for (int j = 0; j < edge * n; ++j) {
          const double a = (i + 0.5) * step - 1, b = (j + 0.5) * step - 1, r2 = 1 + a * a + b * b;
          const Vec3d p = axis == 0 ? Vec3d{sign, a, b} : axis == 1 ? Vec3d{a, sign, b} : Vec3d{a, b, sign};
          visit(texel_of(p, edge), p * (1 / std::sqrt(r2)), step * step / (r2 * std::sqrt(r2)));
        }
}

/// Radiance without lights by a map of random texels: the largest differences between neighbours.
Descriptor random_map_scene(int edge) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> value(0, 10);
  EnvironmentMap map;
  map.levels = {{edge, 0}, {8, 1}};
  map.key_interval_ms = 1000;
  for (std::size_t i = 0; i < texel_count(map.levels); ++i)
    map.texels.push_back(rgb9e5_encode(value(random), value(random), value(random)));
  map.key = environment_key(map);
  Descriptor d = test::constant_scene({5, 5, 5});
  d.environment = std::move(map);
  return d;
}

/// Radiance 3 + x + y / 2 + z / 4, by harmonics.
Descriptor slope_scene() {
  Descriptor d = test::constant_scene({3, 3, 3});
  d.radiance.band = 1;
  const float k = std::sqrt(4 * std::numbers::pi_v<float> / 3);
  const std::array<float, 3> c = {0.5F * k, 0.25F * k, k};  // y, z, x
  for (std::size_t i = 0; i < 3; ++i) d.radiance.c[i + 1] = {c[i], c[i], c[i]};
  return d;
}
TEST(CubeMap, FacesLieAsInOpenGl) {
  const int edge = 64;
  const Lighting light = Lighting::of(slope_scene());
  const Cube cube = cube_of(light, options_of(edge));
  for_each_place(edge, 1, [&](std::size_t texel, const Vec3d& d, double) {
    // A face that is turned or mirrored is off by 0.5 and more. Mean against value at the middle: 1e-3.
    EXPECT_NEAR(cube[texel][0], light.radiance(vec_cast<float>(d), 0).value.r, 5e-3);
    EXPECT_EQ(cube[texel][3], 1);
  });
}

TEST(CubeMap, DirectionsAreThoseOfOpenGl) {
  for (int face = 0; face < 6; ++face)
    for (const float u : {0.1F, 0.5F, 0.8F})
      for (const float v : {0.2F, 0.9F}) {
        const Place p = opengl_place(vec_cast<double>(cube_direction(face, u, v)));
        EXPECT_EQ(p.face, face);
        EXPECT_NEAR(p.s, u, 1e-6);
        EXPECT_NEAR(p.t, v, 1e-6);
      }
}

TEST(CubeMap, TexelsAreMeansOfTheEnvironmentMapOverTheirSolidAngle) {
  // RMS error relative to the standard deviation of the map's texels. Where a cube texel is as wide as a third of a
  // texel of the map, two samples along its edge see the kinks between the map's texels; larger ones average more.
  for (const int map_edge : {32, 64}) {
    const Descriptor scene = random_map_scene(map_edge);
    const Lighting light = Lighting::of(scene);
    for (const int edge : {1, 5, 16, 63, 64}) {
      const Cube cube = cube_of(light, options_of(edge));
      std::vector<std::array<double, 4>> sums(cube.size());
      for_each_place(edge, std::max(8, 512 / edge), [&](std::size_t texel, const Vec3d& d, double solid_angle) {
        const Radiance r = environment_radiance(*scene.environment, vec_cast<float>(d), 0);
        for (int c = 0; c < 3; ++c) sums[texel][static_cast<std::size_t>(c)] += solid_angle * static_cast<double>(r[c]);
        sums[texel][3] += solid_angle;
      });
      double squares = 0;
      for (std::size_t i = 0; i < cube.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c)
          squares += std::pow(static_cast<double>(cube[i][c]) - sums[i][c] / sums[i][3], 2);
      const double rms = std::sqrt(squares / static_cast<double>(3 * cube.size())), deviation = 10 / std::sqrt(12.0);
      RecordProperty("rms_" + std::to_string(map_edge) + "_" + std::to_string(edge), std::to_string(rms / deviation));
      EXPECT_LT(rms / deviation, 0.015) << map_edge << ", " << edge;
    }
  }
}

TEST(CubeMap, LightsKeepTheirEnergyAndPlace) {
  const Vec3d towards = normalized(Vec3d{0.3, 0.55, -0.9});
  for (const float rho : {0.0F, 0.0047F, 0.1F, 0.5F, 1.5F})
    for (const int edge : {1, 7, 64}) {
      Descriptor scene = test::one_light(vec_cast<float>(towards), {30, 20, 10}, rho);
      const Cube cube = cube_of(Lighting::of(scene), options_of(edge));
      double energy = 0;
      Vec3d centroid;
      for_each_place(edge, std::max(4, 64 / edge), [&](std::size_t texel, const Vec3d& d, double solid_angle) {
        energy += solid_angle * static_cast<double>(cube[texel][1]);
        centroid += d * (solid_angle * static_cast<double>(cube[texel][1]));
      });
      const double r = static_cast<double>(rho);
      const double truth = r > 0 ? 20 / cap_vector_irradiance(r) * 2 * std::numbers::pi * (1 - std::cos(r)) : 20;
      // 1e-3: of the quadrature of the test itself.
      EXPECT_NEAR(energy, truth, 1e-3 * truth) << rho << ", " << edge;
      const double angle = angle_between(centroid, towards);
      EXPECT_LT(angle, edge == 1 ? 0.9 : 1.0 / edge) << rho << ", " << edge << ": half a diagonal of a texel";
    }
}

TEST(CubeMap, AWindowThatTexelsShowIsNoCap) {
  Descriptor scene = random_map_scene(16);
  scene.lights = {test::light({0, 0, 1}, {900, 900, 900}, 0.3F)};
  scene.lights[0].track = 5;
  scene.environment->light_tracks = {5};
  scene.environment->light_runs = {0, 256};
  scene.environment->light_texels.assign(256, rgb9e5_encode(64, 64, 64));
  const Lighting light = Lighting::of(scene);
  for (const auto& texel : cube_of(light, options_of(8))) EXPECT_NEAR(texel[0], 64, 1e-3);
  for (const auto& texel : cube_of(light, options_of(8, LightsIncluded::no))) EXPECT_LT(texel[0], 10);
}

TEST(CubeMap, TheInsideOfALargeLightHasItsRadiance) {
  const Vec3d towards = normalized(Vec3d{0.3, 0.55, -0.9});
  const double rho = 0.5, radiance = 20 / cap_vector_irradiance(rho);
  const int edge = 64;
  const Cube cube =
      cube_of(Lighting::of(test::one_light(vec_cast<float>(towards), {30, 20, 10}, 0.5F)), options_of(edge));
  for_each_place(edge, 2, [&](std::size_t texel, const Vec3d& d, double) {
    const double angle = angle_between(d, towards);
    // The energy of the samples is scaled to that of the cap, by 1e-3 here.
    if (angle < rho - 0.04) {
      EXPECT_NEAR(cube[texel][1], radiance, 2e-3 * radiance);
    }
    if (angle > rho + 0.04) {
      EXPECT_EQ(cube[texel][1], 0);
    }
  });
}

TEST(CubeMap, LightsCanBeLeftOut) {
  Descriptor scene = random_map_scene(32);
  const Cube without = cube_of(Lighting::of(scene), options_of(16));
  scene.lights.push_back(test::light({0, 1, 0}, {100, 100, 100}, 0.2F));
  EXPECT_EQ(cube_of(Lighting::of(scene), options_of(16, LightsIncluded::no)), without);
  EXPECT_NE(cube_of(Lighting::of(scene), options_of(16)), without);
}

TEST(CubeMap, IsInTheFrameOfTheLighting) {
  const Quat q = Quat{0.2, -0.5, 0.3, 0.7}.normalized();
  for (const bool with_map : {false, true}) {
    Descriptor scene = with_map ? random_map_scene(32) : slope_scene();
    scene.lights.push_back(test::light({0.2F, 0.9F, 0.1F}, {9, 9, 9}, 0.3F));
    const Lighting light = Lighting::of(scene);
    const int edge = 64;
    const Cube before = cube_of(light, options_of(edge)), after = cube_of(light.rotated(q), options_of(edge));
    double squares = 0, all = 0;
    for_each_place(edge, 1, [&](std::size_t texel, const Vec3d& d, double) {
      const double a = static_cast<double>(before[texel][0]);
      const double b = static_cast<double>(after[texel_of(rotate(q, d), edge)][0]);
      squares += (a - b) * (a - b);
      all += a * a;
    });
    // Texels do not coincide: half a texel apart in a random map. A wrong rotation makes the error above 0.3 and 0.5.
    EXPECT_LT(std::sqrt(squares / all), with_map ? 0.12 : 0.1) << with_map;
  }
}

TEST(CubeMap, FormatsHoldTheSameValues) {
  const Lighting light = Lighting::of(random_map_scene(64));
  const int edge = 32;
  for (const float scale : {1.0F, 1e-6F, 1000.0F}) {
    CubeMapOptions options = options_of(edge);
    options.scale = scale;
    const Cube floats = cube_of(light, options);
    options.format = CubeFormat::rgba16f;
    std::vector<std::array<std::uint16_t, 4>> halves(floats.size());
    EXPECT_EQ(cube_map(light, options, std::as_writable_bytes(std::span(halves))).value, 0U);
    options.format = CubeFormat::rgb9e5;
    std::vector<std::uint32_t> shared(floats.size());
    EXPECT_EQ(cube_map(light, options, std::as_writable_bytes(std::span(shared))).value, 0U);
    for (std::size_t i = 0; i < floats.size(); ++i) {
      const float most = std::max({floats[i][0], floats[i][1], floats[i][2]});
      for (std::size_t c = 0; c < 3; ++c) {
        const int exponent = halves[i][c] >> 10, mantissa = halves[i][c] & 1023;
        const double half = exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(1024 + mantissa, exponent - 25);
        const auto v = static_cast<double>(floats[i][c]);
        // Half of a unit in the last place: of 11 bits, or of the smallest subnormal.
        EXPECT_NEAR(half, v, std::max(std::ldexp(v, -11), std::ldexp(1.0, -25)));
        EXPECT_NEAR(rgb9e5_decode(shared[i])[c], floats[i][c], most / 511 + 0x1p-25F);
      }
      EXPECT_EQ(halves[i][3], 0x3C00) << "alpha 1";
    }
  }
}

TEST(CubeMap, ValuesAboveTheRangeOfTheFormatAreCounted) {
  const Lighting light = Lighting::of(test::one_light({0, 1, 0}, {1e9F, 1e9F, 1e9F}, 0.0047F));
  CubeMapOptions options;
  std::vector<std::array<std::uint16_t, 4>> halves(6 * 64 * 64);
  const Answer<std::size_t> bright = cube_map(light, options, std::as_writable_bytes(std::span(halves)));
  EXPECT_EQ(bright.value, 4U) << "the texels around the middle of the upper face";
  EXPECT_EQ(halves[(2 * 64 + 31) * 64 + 31][0], 0x7BFF) << "65504";
  options.scale = 1e-9F;
  EXPECT_EQ(cube_map(light, options, std::as_writable_bytes(std::span(halves))).value, 0U);
}

TEST(CubeMap, RefusesWhatIsNotAllowedAndWritesNothing) {
  const Lighting light = Lighting::of(test::constant_scene({1, 1, 1}));
  std::vector<std::byte> texels(cube_map_bytes(64, CubeFormat::rgba32f), std::byte{7});
  const std::vector<std::byte> before = texels;
  const auto refused = [&](const CubeMapOptions& options, std::size_t size) {
    const Answer<std::size_t> answer = cube_map(light, options, std::span(texels).first(size));
    return answer.validity == Validity::invalid_query && texels == before;
  };
  EXPECT_EQ(cube_map_bytes(0, CubeFormat::rgba16f), 0U);
  EXPECT_EQ(cube_map_bytes(65, CubeFormat::rgba16f), 0U);
  for (const int edge : {0, -1, 65, std::numeric_limits<int>::max(), std::numeric_limits<int>::min()})
    EXPECT_TRUE(refused(options_of(edge), 0) && refused(options_of(edge), texels.size())) << edge;
  for (const float scale : {0.0F, -1.0F, std::nanf(""), std::numeric_limits<float>::infinity()}) {
    CubeMapOptions options = options_of(64);
    options.scale = scale;
    EXPECT_TRUE(refused(options, texels.size())) << scale;
  }
  CubeMapOptions unknown = options_of(64);
  unknown.format = static_cast<CubeFormat>(9);
  EXPECT_TRUE(refused(unknown, cube_map_bytes(64, unknown.format)));
  EXPECT_TRUE(refused(options_of(64), texels.size() - 1));
  EXPECT_TRUE(refused(options_of(32), texels.size()));
}

TEST(CubeMap, WithoutLightIsBlackAndSaysSo) {
  Cube cube(6, {7, 7, 7, 7});
  const Answer<std::size_t> none = cube_map({}, options_of(1), std::as_writable_bytes(std::span(cube)));
  EXPECT_EQ(none.validity, Validity::none);
  for (const auto& texel : cube) EXPECT_EQ(texel, (std::array<float, 4>{0, 0, 0, 1}));
  const Lighting old = Lighting::of(test::constant_scene({2, 2, 2}), Duration{1'000'000'000});
  const Answer<std::size_t> stale = cube_map(old, options_of(1), std::as_writable_bytes(std::span(cube)));
  EXPECT_EQ(stale.validity, Validity::stale);
  EXPECT_EQ(stale.age.ns, 1'000'000'000);
  EXPECT_NEAR(cube[3][1], 2, 1e-5);
}

}  // namespace
}  // namespace lightwell
