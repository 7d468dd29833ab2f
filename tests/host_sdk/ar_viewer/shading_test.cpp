// Objects against closed forms and against the SDK's own answers.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <numbers>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/cap.hpp>
#include <lightwell/cube_map.hpp>
#include <lightwell/environment.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/pixel.hpp>

#include "host_sdk/ar_viewer/viewer_scenes.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::test {
namespace {

constexpr double kRadius = 0.1;
constexpr Vec3d kCentre{0, kRadius, 0};

/// All bands, three lights of different size: point, lamp, window.
Descriptor rich_light() {
  Descriptor d = uniform_light({0.5F, 0.6F, 0.7F});
  d.radiance.band = 4;
  for (int i = 1; i < sh_count(4); ++i) {
    const float a = 0.25F * static_cast<float>(std::sin(3.1 * i)) / std::sqrt(static_cast<float>(i));
    d.radiance.c[static_cast<std::size_t>(i)] = {a, 0.7F * a, -0.4F * a};
  }
  d.lights = {make_light({0.5F, 0.8F, 0.6F}, {2, 1.6F, 1}, 0.3), make_light({-0.9F, 0.4F, 0.5F}, {0.3F, 0.5F, 1}, 8),
              make_light({0.1F, 0.1F, 1}, {0.4F, 0.4F, 0.4F}, 35)};
  return d;
}

viewer::Scene sphere_scene(const viewer::Material& material) {
  viewer::Scene scene = make_viewer_scene();
  scene.objects = {make_object("sphere", {2 * kRadius})};
  scene.objects[0].material = material;
  return scene;
}

TEST(ViewerShading, AMatteSphereHasTheIrradianceOfTheSdkInEveryPixel) {
  viewer::Scene scene = sphere_scene({});
  const Descriptor light = rich_light();
  set_light(scene, light);
  const Lighting lighting = Lighting::of(light);
  const Rendered picture = render(scene);
  ASSERT_FALSE(picture.frame.empty());
  double largest = 0, worst = 0, squares = 0;
  int pixels = 0;
  for_sphere_pixels(scene, kCentre, kRadius, 0.02, [&](int column, int row, Vec3d, Vec3d normal) {
    const Radiance expected =
        reflected_radiance(lighting.irradiance(vec_cast<float>(normal)).value, {0.8F, 0.8F, 0.8F});
    for (int c = 0; c < 3; ++c) {
      const double difference =
          static_cast<double>(picture.frame.at(column, row)[c]) - static_cast<double>(std::max(expected[c], 0.0F));
      worst = std::max(worst, std::abs(difference));
      squares += difference * difference;
      largest = std::max(largest, static_cast<double>(expected[c]));
    }
    ++pixels;
  });
  EXPECT_GT(pixels, 20000);
  // A facet's middle is 0.1 % of the radius below the sphere, which moves normals by up to 0.02 near the rim; the flat
  // disc of the lamp adds less.
  EXPECT_LT(worst, 0.02 * largest);
  EXPECT_LT(std::sqrt(squares / (3 * pixels)), 0.002 * largest);
}

TEST(ViewerShading, ConstantLightShadesNothing) {
  viewer::Scene scene = sphere_scene({});
  scene.shading = viewer::Shading::constant;
  scene.ground = viewer::Ground{};
  const Descriptor light = rich_light();
  set_light(scene, light);
  // Mean of the SDK's irradiance over all normals: pi times the mean radiance.
  Irradiance mean;
  constexpr int kNormals = 2000;
  for (int i = 0; i < kNormals; ++i)
    mean += Lighting::of(light).irradiance(vec_cast<float>(fibonacci_direction(i, kNormals))).value * (1.0F / kNormals);
  const Radiance expected = reflected_radiance(mean, {0.8F, 0.8F, 0.8F});
  const Rendered picture = render(scene);
  for_sphere_pixels(scene, kCentre, kRadius, 0.02, [&](int column, int row, Vec3d, Vec3d) {
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(picture.frame.at(column, row)[c], expected[c], 2e-3 * expected[c]);
  });
  EXPECT_THAT(picture.shadow.rgba, testing::Each(1.0F));
}

TEST(ViewerShading, MainLightAndNineCoefficientsKeepTheMeanAndLoseTheSize) {
  viewer::Scene scene = sphere_scene({});
  scene.shading = viewer::Shading::main_light_and_sh9;
  const Descriptor light = rich_light();
  set_light(scene, light);
  // The same by hand: the strongest light as a point, the others in the harmonics up to band 2.
  Descriptor reduced = light;
  reduced.lights = {make_light(light.lights[0].direction, light.lights[0].irradiance, 0)};
  reduced.radiance = {};
  reduced.radiance.band = 2;
  for (int i = 0; i < sh_count(2); ++i) {
    const auto k = static_cast<std::size_t>(i);
    reduced.radiance.c[k] = light.radiance.c[k];
    for (std::size_t l = 1; l < light.lights.size(); ++l) {
      std::vector<double> basis(sh_count(2));
      sh_basis(2, vec_cast<double>(light.lights[l].direction), basis);
      const int band = i == 0 ? 0 : i < 4 ? 1 : 2;
      const auto factor =
          static_cast<float>(cap_zonal(band, static_cast<double>(light.lights[l].angular_radius_rad)) * basis[k]);
      const Irradiance& e = light.lights[l].irradiance;
      reduced.radiance.c[k] += Radiance{e.r, e.g, e.b} * factor;
    }
  }
  const Lighting expected = Lighting::of(reduced);
  const Rendered picture = render(scene);
  for_sphere_pixels(scene, kCentre, kRadius, 0.05, [&](int column, int row, Vec3d, Vec3d normal) {
    // Facets: 0.02 of the largest irradiance, as above.
    const Radiance e = reflected_radiance(expected.irradiance(vec_cast<float>(normal)).value, {0.8F, 0.8F, 0.8F});
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(picture.frame.at(column, row)[c], std::max(e[c], 0.0F), 0.02);
  });
}

/// A map whose texels at roughness 0 encode their direction, in an exponent that RGB9E5 holds without loss for 1/256
/// steps.
Descriptor light_with_map() {
  Descriptor d = uniform_light({0.5F, 0.5F, 0.5F});
  EnvironmentMap map;
  map.levels = {{64, 0}, {8, 1}};
  map.key_interval_ms = 1000;
  for (const EnvironmentLevel& level : map.levels)
    for (int j = 0; j < level.edge; ++j)
      for (int i = 0; i < level.edge; ++i) {
        const Vec3f t = texel_direction(level.edge, i, j);
        map.texels.push_back(rgb9e5_encode(0.5F + 0.5F * t.x, 0.5F + 0.5F * t.y, 0.5F + 0.5F * t.z));
      }
  map.key = environment_key(map);
  d.environment = map;
  return d;
}

TEST(ViewerShading, AMirrorShowsTheMapInTheMirroredDirectionOfATurnedProbe) {
  viewer::Material mirror;
  mirror.lambert = 0;
  mirror.reflection = 1;
  viewer::Scene scene = sphere_scene(mirror);
  scene.T_world_probe = Pose{Quat::about(normalized(Vec3d{1, 2, 3}), 1.1), {0.1, 0.3, 0.2}};
  set_light(scene, light_with_map());
  const Rendered picture = render(scene);
  double worst = 0;
  for_sphere_pixels(scene, kCentre, kRadius, 0.02, [&](int column, int row, Vec3d, Vec3d normal) {
    const Vec3d ray = ray_of(scene, column, row);
    const Vec3d mirrored = ray - normal * (2 * dot(ray, normal));
    const Vec3d in_probe = rotate(scene.T_world_probe->rotation.inverse(), mirrored);
    const float* p = picture.frame.at(column, row);
    const Vec3d expected = in_probe * 0.5 + Vec3d{0.5, 0.5, 0.5};
    worst = std::max(worst, length(Vec3d{p[0], p[1], p[2]} - expected));
  });
  // A texel of the map has 1.4 degrees; facets turn mirrored rays near the rim by up to 0.04.
  EXPECT_LT(worst, 0.03);
}

TEST(ViewerShading, ALightThatTexelsShowIsTheseTexelsAndNoDisc) {
  viewer::Material mirror;
  mirror.lambert = 0;
  mirror.reflection = 1;
  Descriptor d = light_with_map();
  d.lights = {make_light({0.3F, 0.9F, 0.8F}, {3, 3, 3}, 20)};
  d.lights[0].track = 5;
  d.environment->light_tracks = {5};
  d.environment->light_runs = {0, 64 * 64};
  d.environment->light_texels.assign(64 * 64, rgb9e5_encode(2, 2, 2));
  const Lighting lighting = Lighting::of(d);
  const auto expected_at = [&](Vec3f to, float roughness) {
    return roughness > 0 ? lighting.radiance(to, roughness).value.g
                         : environment_radiance(lighting.environment()->mirror, to, 0).g;
  };
  for (const float roughness : {0.0F, 0.3F, 0.6F}) {
    mirror.roughness = roughness;
    viewer::Scene scene = sphere_scene(mirror);
    set_light(scene, d);
    const Rendered picture = render(scene);
    double largest = 0;
    for_sphere_pixels(scene, kCentre, kRadius, 0.05, [&](int column, int row, Vec3d, Vec3d normal) {
      const Vec3d ray = ray_of(scene, column, row);
      const float expected = expected_at(vec_cast<float>(ray - normal * (2 * dot(ray, normal))), roughness);
      // Levels of the cube map are as far apart as 0.2; the lobe in closed form and facets.
      ASSERT_NEAR(picture.frame.at(column, row)[1], expected, 0.06F * (1 + expected)) << roughness;
      largest = std::max(largest, static_cast<double>(expected));
    });
    EXPECT_GT(largest, roughness > 0 ? 2.1 : 1.9) << "the cap has a share in rough reflections";
  }
}

TEST(ViewerShading, AMirrorShowsALampAsADiscOfItsRadiance) {
  viewer::Material mirror;
  mirror.lambert = 0;
  mirror.reflection = 1;
  viewer::Scene scene = sphere_scene(mirror);
  Descriptor d = uniform_light({0, 0, 0});
  d.lights = {make_light({0.3F, 0.9F, 0.8F}, {1, 1, 1}, 6)};
  set_light(scene, d);
  const double radiance = 1 / cap_vector_irradiance(6 * std::numbers::pi / 180);
  const Rendered picture = render(scene);
  int inside = 0;
  for_sphere_pixels(scene, kCentre, kRadius, 0.05, [&](int column, int row, Vec3d, Vec3d normal) {
    const Vec3d ray = ray_of(scene, column, row);
    const double angle = angle_between(ray - normal * (2 * dot(ray, normal)), vec_cast<double>(d.lights[0].direction)) *
                         180 / std::numbers::pi;
    const double value = static_cast<double>(picture.frame.at(column, row)[0]);
    // Half a degree at the edge of the disc is left out: it has the width of a pixel there.
    if (angle < 5.3) {
      EXPECT_NEAR(value, radiance, 0.04 * radiance) << angle;
      ++inside;
    } else if (angle > 7) {
      EXPECT_LT(value, 0.01 * radiance) << angle;
    }
  });
  EXPECT_GT(inside, 30);
}

TEST(ViewerShading, AMirrorOfTheCubeMapSourceShowsTheCubeMapOfTheSdk) {
  viewer::Material mirror;
  mirror.lambert = 0;
  mirror.reflection = 1;
  viewer::Scene scene = sphere_scene(mirror);
  scene.reflection.source = viewer::ReflectionSource::cube_map;
  scene.reflection.edge = 32;
  Descriptor light = rich_light();
  light.lights.erase(light.lights.begin());  // The small lamp is a hundred times as bright as the texel beside it.
  set_light(scene, light);
  std::vector<std::byte> bytes(cube_map_bytes(32, CubeFormat::rgba32f));
  ASSERT_EQ(cube_map(Lighting::of(light), {32, CubeFormat::rgba32f}, bytes).validity, Validity::valid);
  const Rendered picture = render(scene);
  int compared = 0;
  double squares = 0, largest = 0;
  for_sphere_pixels(scene, kCentre, kRadius, 0.2, [&](int column, int row, Vec3d, Vec3d normal) {
    const Vec3d ray = ray_of(scene, column, row);
    const Vec3f d = vec_cast<float>(ray - normal * (2 * dot(ray, normal)));
    int face = 0;
    for (int f = 1; f < 6; ++f)
      if (dot(d, cube_direction(f, 0.5F, 0.5F)) > dot(d, cube_direction(face, 0.5F, 0.5F))) face = f;
    const Vec3f axis = cube_direction(face, 0.5F, 0.5F), on_face = d * (1 / dot(d, axis)) - axis;
    const float root = std::sqrt(2.0F);
    const float u = 16 + 16 * dot(on_face, cube_direction(face, 1, 0.5F) * root - axis);
    const float v = 16 + 16 * dot(on_face, cube_direction(face, 0.5F, 1) * root - axis);
    // Near the middle of a texel the filter shows that texel alone.
    if (std::abs(u - std::floor(u) - 0.5F) > 0.05F || std::abs(v - std::floor(v) - 0.5F) > 0.05F) return;
    const std::size_t texel =
        (static_cast<std::size_t>(face) * 32 + static_cast<std::size_t>(v)) * 32 + static_cast<std::size_t>(u);
    float expected = 0;
    std::memcpy(&expected, bytes.data() + 16 * texel, sizeof expected);
    const double error = static_cast<double>(picture.frame.at(column, row)[0] - expected);
    squares += error * error;
    largest = std::max(largest, static_cast<double>(expected));
    ++compared;
  });
  EXPECT_GT(compared, 50);
  EXPECT_GT(largest, 3) << "a lamp is among them";
  // Facets turn mirrored rays by up to a fifth of a texel, which mixes neighbours at the edge of a lamp.
  EXPECT_LT(std::sqrt(squares / compared), 0.05 * largest);
}

TEST(ViewerShading, OffIsTheBackgroundBitByBit) {
  const TempDir folder;
  viewer::Picture background;
  background.resize(640, 360);
  for (int row = 0; row < 360; ++row)
    for (int column = 0; column < 640; ++column)
      for (int c = 0; c < 3; ++c)
        background.at(column, row)[c] =
            viewer::srgb_linear(static_cast<std::uint8_t>((column * 7 + row * 3 + c * 85) % 256));
  const std::string path = folder.path("background.png");
  ASSERT_TRUE(viewer::write_png(path, background).ok());
  viewer::Scene scene = sphere_scene({});
  scene.ground = viewer::Ground{};
  scene.background = path;
  scene.shading = viewer::Shading::off;
  scene.exposure = 3;
  set_light(scene, rich_light());
  const Rendered picture = render(scene);
  const std::string shown = folder.path("shown.png");
  ASSERT_TRUE(viewer::write_png(shown, picture.frame).ok());
  const auto before = viewer::read_bytes(path), after = viewer::read_bytes(shown);
  ASSERT_TRUE(before.ok() && after.ok());
  EXPECT_EQ(before->rgb, after->rgb);
}

TEST(ViewerShading, SideBySideShowsBothHalves) {
  viewer::Scene scene = sphere_scene({});
  set_light(scene, rich_light());
  const Rendered full = render(scene);
  scene.shading = viewer::Shading::constant;
  const Rendered constant = render(scene);
  scene.side_by_side = viewer::Shading::full;
  const Rendered both = render(scene);
  for (int row = 0; row < 360; row += 7)
    for (int column = 0; column < 640; column += 3)
      for (int c = 0; c < 3; ++c)
        ASSERT_EQ(both.frame.at(column, row)[c], (column < 320 ? constant : full).frame.at(column, row)[c])
            << column << ", " << row;
}

TEST(ViewerShading, ExposureIsAFactorOfTheObjects) {
  viewer::Scene scene = sphere_scene({});
  set_light(scene, rich_light());
  const Rendered once = render(scene);
  scene.exposure = 2;
  const Rendered twice = render(scene);
  const float* a = once.frame.at(320, 150);
  const float* b = twice.frame.at(320, 150);
  ASSERT_GT(a[1], 0.1F);
  EXPECT_NEAR(b[1], 2 * a[1], 1e-5);
  EXPECT_EQ(a[3], 1.0F) << "A is the share that objects cover";
  EXPECT_EQ(once.frame.at(5, 5)[3], 0.0F);
}

}  // namespace
}  // namespace lightwell::test
