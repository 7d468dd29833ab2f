// Lightwell's light in Filament's conventions, evaluated by Filament itself: Debian's library, with a headless engine.
#include <cmath>
#include <cstddef>
#include <memory>

#include <filament/Engine.h>
#include <filament/IndirectLight.h>
#include <gtest/gtest.h>
#include <ibl/Cubemap.h>
#include <ibl/CubemapSH.h>
#include <ibl/CubemapUtils.h>
#include <ibl/Image.h>

#include <lightwell/conventions.hpp>

namespace lightwell {
namespace {

using filament::math::float3;

class FilamentEngine : public ::testing::Test {
 protected:
  FilamentEngine() : engine_(filament::Engine::create(filament::Engine::Backend::NOOP)) {}
  ~FilamentEngine() override { filament::Engine::destroy(&engine_); }

  filament::Engine* engine_;
};

/// All nine functions in three colours without a main light, so that everything is in the harmonics.
Lighting room() {
  Descriptor descriptor;
  descriptor.radiance.band = 2;
  for (int i = 0; i < 9; ++i) {
    const float v = std::sin(static_cast<float>(2 * i + 1));
    descriptor.radiance.c[static_cast<std::size_t>(i)] =
        i == 0 ? Radiance{30, 20, 10} : Radiance{3 * v, 2 * std::cos(static_cast<float>(i)), -v};
  }
  return Lighting::of(descriptor);
}

Lighting lamp(Vec3f towards) {
  Descriptor descriptor;
  Light light;
  light.direction = normalized(towards);
  light.irradiance = {8, 8, 8};
  descriptor.lights.push_back(light);
  return Lighting::of(descriptor);
}

std::unique_ptr<float3[]> list_of(const std::array<std::array<float, 3>, 9>& coefficients) {
  auto out = std::make_unique<float3[]>(9);
  for (std::size_t i = 0; i < 9; ++i) out[i] = {coefficients[i][0], coefficients[i][1], coefficients[i][2]};
  return out;
}

TEST_F(FilamentEngine, ShadesASphereAsLightwell) {
  // renderPreScaledSH3Bands "is exactly the code ran by our shader" (CubemapSH.h), over the normals of a cube.
  const Lighting lighting = room();
  const auto sh = list_of(to_filament(lighting).value.irradiance);
  filament::ibl::Image faces;
  constexpr std::size_t kEdge = 16;
  filament::ibl::Cubemap cube = filament::ibl::CubemapUtils::create(faces, kEdge);
  filament::ibl::CubemapSH::renderPreScaledSH3Bands(engine_->getJobSystem(), cube, sh);
  for (int face = 0; face < 6; ++face)
    for (std::size_t y = 0; y < kEdge; ++y)
      for (std::size_t x = 0; x < kEdge; ++x) {
        const auto which = static_cast<filament::ibl::Cubemap::Face>(face);
        const auto n = cube.getDirectionFor(which, x, y);
        const float3& shown = *static_cast<const float3*>(cube.getImageForFace(which).getPixelRef(x, y));
        const Radiance white = reflected_radiance(lighting.irradiance({n.x, n.y, n.z}).value, {1, 1, 1});
        // Rounding of sums of nine products in single precision.
        ASSERT_NEAR(shown.r, white.r, 1e-4);
        ASSERT_NEAR(shown.g, white.g, 1e-4);
        ASSERT_NEAR(shown.b, white.b, 1e-4);
      }
}

TEST_F(FilamentEngine, FindsTheDirectionOfALamp) {
  for (const Vec3f towards : {Vec3f{1, 0, 0}, Vec3f{0, 1, 0}, Vec3f{0, 0, -1}, Vec3f{-0.4F, 0.7F, 0.5F}}) {
    const auto inside = to_filament(lamp(towards), MainLight::in_harmonics).value;
    const auto apart = to_filament(lamp(towards)).value;
    // Compares the direction that Filament derives from the harmonics with Lightwell's main light.
    const float3 found = filament::IndirectLight::getDirectionEstimate(list_of(inside.irradiance).get());
    EXPECT_NEAR(found.x, apart.direction[0], 1e-5);
    EXPECT_NEAR(found.y, apart.direction[1], 1e-5);
    EXPECT_NEAR(found.z, apart.direction[2], 1e-5);
  }
}

TEST_F(FilamentEngine, RadianceAndIrradianceCoefficientsGiveTheSameLight) {
  // The engine pre-scales the coefficients of radiance(), so both lists must give the same light.
  const auto light = to_filament(room()).value;
  const auto irradiance = list_of(light.irradiance), radiance = list_of(light.radiance);
  const auto built = [&](filament::IndirectLight::Builder&& builder) { return builder.build(*engine_); };
  filament::IndirectLight::Builder from_irradiance, from_radiance;
  from_irradiance.irradiance(3, irradiance.get()).intensity(light.indirectIntensity);
  from_radiance.radiance(3, radiance.get()).intensity(light.indirectIntensity);
  filament::IndirectLight* const a = built(std::move(from_irradiance));
  filament::IndirectLight* const b = built(std::move(from_radiance));
  ASSERT_TRUE(a != nullptr && b != nullptr);
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"  // The only access to the stored coefficients.
  for (const float3 d : {float3{1, 0, 0}, float3{0, 1, 0}, float3{0, 0, 1}, float3{0.6F, -0.48F, 0.64F}}) {
    const auto of_a = a->getColorEstimate(d), of_b = b->getColorEstimate(d);
    for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(of_a[k], of_b[k], 1e-4 * std::abs(of_a[k]));
  }
  const float3 towards_a = a->getDirectionEstimate(), towards_b = b->getDirectionEstimate();
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(towards_a[k], towards_b[k], 1e-4);
#pragma GCC diagnostic pop
  EXPECT_EQ(a->getIntensity(), 1);
  engine_->destroy(a);
  engine_->destroy(b);
}

}  // namespace
}  // namespace lightwell
