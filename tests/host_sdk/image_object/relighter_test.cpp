// Relighting of decoded views (equations 8 to 10), and interpolation between lights.
#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/image_object.hpp>

#include "host_sdk/image_object/matte_ball.hpp"
#include "image_object/light_arrangement.hpp"

namespace lightwell::test {
namespace {

using testing::HasSubstr;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();

ObjectLight white(Vec3f direction) { return {direction, {1, 1, 1}}; }

TEST(ObjectRelighter, ReproducesThePictureOfEachCapturedLight) {
  const Ball ball(21, 0.4F);
  const ObjectView view = view_of(ball);
  for (std::size_t i = 0; i < ball.lit.size(); ++i)
    for (const LightInterpolation kind : {LightInterpolation::nearest, LightInterpolation::smooth})
      EXPECT_LT(rms(relit(view, {white(ball.rig.light_positions[i])}, kind), ball.lit[i]), 0.004) << i;
}

TEST(ObjectRelighter, BetweenCapturedLightsIsFiveTimesAsExactAsTheNearest) {
  const Ball ball;
  const ObjectView view = view_of(ball);
  const Vec3f between = Ball::on_arc(9.5 / 20);
  const double nearest = rms(relit(view, {white(between)}, LightInterpolation::nearest), ball.picture(between));
  const double smooth = rms(relit(view, {white(between)}, LightInterpolation::smooth), ball.picture(between));
  EXPECT_LT(smooth, 0.2 * nearest);
}

TEST(ObjectRelighter, NearestIsThePictureOfTheNearestLight) {
  const Ball ball;
  const ObjectView view = view_of(ball);
  EXPECT_EQ(relit(view, {white(Ball::on_arc(9.4 / 20))}, LightInterpolation::nearest),
            relit(view, {white(ball.rig.light_positions[9])}, LightInterpolation::nearest));
}

TEST(ObjectRelighter, AddsLights) {
  const Ball ball(21, 0.4F);
  const ObjectView view = view_of(ball);
  // Six: more than are computed together.
  std::vector<ObjectLight> lights;
  std::vector<Radiance> sum(view.coverage().size());
  for (int i = 0; i < 6; ++i) {
    lights.push_back({Ball::on_arc(0.1 + 0.15 * i), {0.5F, 1.0F + static_cast<float>(i), 2}});
    const auto one = relit(view, {lights.back()});
    for (std::size_t p = 0; p < sum.size(); ++p) sum[p] += one[p];
  }
  EXPECT_LT(rms(relit(view, lights), sum), 1e-5);
}

TEST(ObjectRelighter, ScalesEachChannelByTheIrradianceOfTheLight) {
  Ball ball;
  ball.rig.reference_irradiance = 4;
  const ObjectView view = view_of(ball);
  const Vec3f towards = ball.rig.light_positions[8];
  auto coloured = relit(view, {{towards, {4, 2, 8}}});
  for (Radiance& p : coloured) p = {p.r, p.g * 2, p.b * 0.5F};
  EXPECT_LT(rms(coloured, ball.lit[8]), 0.004);
}

TEST(ObjectRelighter, GivesHighlightsTheColourOfTheLight) {
  const Ball ball(21, 1.5F);
  const auto blue = relit(view_of(ball), {{Ball::on_arc(0.5), {0, 0, 1}}});
  for (const Radiance& p : blue) EXPECT_EQ(p.r + p.g, 0);
  // At the highlight the ball's own blue is a small part.
  float brightest = 0;
  for (const Radiance& p : blue) brightest = std::max(brightest, p.b);
  EXPECT_GT(brightest, 1.5F);
}

TEST(ObjectRelighter, TurnsLightsWithTheView) {
  Ball ball;
  const float turn = 0.3F;
  ball.rig.turns_rad = {turn};
  // The object turns by 0.3 about +Y; a light that is fixed in the rig turns by -0.3 in the object's frame.
  const Vec3f rig = ball.rig.light_positions[12];
  const Vec3f object = rotate(Quat::about({0, 1, 0}, -static_cast<double>(turn)), rig);
  EXPECT_LT(rms(relit(view_of(ball), {white(object)}), ball.lit[12]), 0.004);
}

TEST(ObjectRelighter, WithoutLightsIsBlack) {
  const ObjectView view = view_of(Ball());
  for (const Radiance& p : relit(view, {})) EXPECT_EQ(p, Radiance{});
  for (const Radiance& p : relit(view, {{{0, 0, 1}, {}}})) EXPECT_EQ(p, Radiance{});
}

TEST(ObjectRelighter, FromBehindTakesTheNearestCapturedLightAndSaysHowFarItIs) {
  const Ball ball;
  const ObjectView view = view_of(ball);
  ObjectRelighter relighter;
  std::vector<Radiance> out(view.coverage().size());
  const std::array<ObjectLight, 1> behind = {white({0.3F, 0, -1})};
  const auto done = relighter.relight(view, behind, LightInterpolation::smooth, out);
  ASSERT_TRUE(done.ok());
  EXPECT_EQ(done->lights, 1);
  EXPECT_GT(done->outside_rad, 1.2F);
  EXPECT_LT(rms(out, ball.lit[0]), 0.004);
}

TEST(ObjectRelighter, RefusesLightsThatAreNone) {
  const ObjectView view = view_of(Ball());
  ObjectRelighter relighter;
  std::vector<Radiance> out(view.coverage().size(), {7, 7, 7});
  const auto refusal = [&](ObjectLight light) {
    const std::array<ObjectLight, 2> lights = {white({0, 0, 1}), light};
    const auto done = relighter.relight(view, lights, LightInterpolation::smooth, out);
    EXPECT_EQ(done.status().code(), StatusCode::invalid_argument);
    EXPECT_EQ(out[0], (Radiance{7, 7, 7}));
    return done.status().message();
  };
  EXPECT_THAT(refusal(white({0, 0, 0})), HasSubstr("light 1 has a direction that is zero"));
  EXPECT_THAT(refusal(white({kNan, 0, 1})), HasSubstr("light 1 has a direction"));
  EXPECT_THAT(refusal(white({0, kInf, 1})), HasSubstr("light 1 has a direction"));
  EXPECT_THAT(refusal({{0, 0, 1}, {-1, 0, 0}}), HasSubstr("light 1 has an irradiance that is negative"));
  EXPECT_THAT(refusal({{0, 0, 1}, {0, kNan, 0}}), HasSubstr("not finite"));
  EXPECT_THAT(refusal({{0, 0, 1}, {0, kInf, 0}}), HasSubstr("not finite"));
  EXPECT_THAT(refusal({{0, 0, 1}, {1e30F, 0, 0}}), HasSubstr("1e20 times"));
  out.pop_back();
  EXPECT_THAT(relighter.relight(view, {}, LightInterpolation::smooth, out).status().message(),
              HasSubstr("1599 pixels"));
}

TEST(ObjectRelighter, OfOneLightPositionUsesItForAll) {
  const Ball ball(1);
  EXPECT_LT(rms(relit(view_of(ball), {white({1, 0, 0})}), ball.lit[0]), 0.004);
}

TEST(ObjectRelighter, WorksForPicturesThatBlocksDoNotDivide) {
  Ball ball(5);
  constexpr int kColumns = 37, kRows = 21;
  const auto cropped = [](const auto& whole) {
    std::remove_cvref_t<decltype(whole)> out;
    for (int y = 0; y < kRows; ++y)
      for (int x = 0; x < kColumns; ++x) out.push_back(whole[static_cast<std::size_t>(y * Ball::kSide + x)]);
    return out;
  };
  ball.rig.columns = kColumns;
  ball.rig.rows = kRows;
  ball.ambient = cropped(ball.ambient);
  ball.coverage = cropped(ball.coverage);
  for (auto& picture : ball.lit) picture = cropped(picture);
  EXPECT_LT(rms(relit(view_of(ball), {white(ball.rig.light_positions[2])}), ball.lit[2]), 0.004);
}

double sum_of(const image_object::LightWeights& weights) {
  double sum = 0;
  for (std::size_t i = 0; i < weights.count; ++i) sum += weights.entries[i].weight;
  return sum;
}

std::vector<Vec3f> hemisphere(int count) {
  std::vector<Vec3f> out;
  for (int i = 0; i < 2 * count; ++i)
    if (const Vec3d d = fibonacci_direction(i, 2 * count); d.z > 0) out.push_back(vec_cast<float>(d));
  return out;
}

TEST(LightWeights, AreOneAtACapturedLight) {
  for (const auto& directions : {hemisphere(80), Ball(15).rig.light_positions}) {
    std::vector<Vec3f> unit;
    for (const Vec3f& d : directions) unit.push_back(normalized(d));
    for (std::size_t i = 0; i < unit.size(); ++i) {
      const auto weights = image_object::smooth_lights(unit, vec_cast<double>(unit[i]));
      for (std::size_t k = 0; k < weights.count; ++k)
        EXPECT_NEAR(weights.entries[k].weight, weights.entries[k].light == i ? 1 : 0, 1e-5);
    }
  }
}

TEST(LightWeights, SumToOneAndExtrapolateNothing) {
  const auto directions = hemisphere(80);
  for (int i = 0; i < 500; ++i) {
    const auto weights = image_object::smooth_lights(directions, fibonacci_direction(i, 500));
    EXPECT_NEAR(sum_of(weights), 1, 1e-9);
    for (std::size_t k = 0; k < weights.count; ++k) EXPECT_LT(std::abs(weights.entries[k].weight), 1.5);
  }
}

TEST(LightWeights, MidwayOnAnArcAreNearlyThoseOfACubic) {
  std::vector<Vec3f> arc;
  for (int i = 0; i < 61; ++i) arc.push_back(normalized(Ball::on_arc(i / 60.0)));
  const auto weights = image_object::smooth_lights(arc, vec_cast<double>(normalized(arc[30] + arc[31])));
  double inner = 0;
  for (std::size_t k = 0; k < weights.count; ++k)
    if (weights.entries[k].light == 30 || weights.entries[k].light == 31) inner += weights.entries[k].weight;
  EXPECT_NEAR(inner, 9.0 / 8, 0.06);
}

TEST(LightWeights, InterpolateASmoothFunctionOverTheHemisphere) {
  const auto directions = hemisphere(150);
  const auto f = [](Vec3d d) { return 1 + 0.5 * d.x - 0.3 * d.y * d.z + 0.4 * d.x * d.y; };
  double smooth = 0, nearest = 0;
  for (int i = 0; i < 400; ++i) {
    const Vec3d d = fibonacci_direction(i, 400);
    if (d.z < 0.3) continue;
    double sum = 0;
    const auto weights = image_object::smooth_lights(directions, d);
    for (std::size_t k = 0; k < weights.count; ++k)
      sum += weights.entries[k].weight * f(vec_cast<double>(directions[weights.entries[k].light]));
    const auto one = image_object::nearest_light(directions, d);
    smooth += std::abs(sum - f(d));
    nearest += std::abs(f(vec_cast<double>(directions[one.entries[0].light])) - f(d));
  }
  EXPECT_LT(smooth, 0.15 * nearest);
}

TEST(LightWeights, OfEqualDirectionsAreFinite) {
  const std::vector<Vec3f> twins(4, Vec3f{0, 0, 1});
  EXPECT_EQ(sum_of(image_object::smooth_lights(twins, {1, 0, 0})), 1);
  std::vector<Vec3f> mixed = twins;
  mixed.push_back({1, 0, 0});
  const auto weights = image_object::smooth_lights(mixed, normalized(Vec3d{1, 0, 1}));
  EXPECT_NEAR(weights.entries[0].weight, 0.5, 1e-6);
  EXPECT_NEAR(weights.entries[1].weight, 0.5, 1e-6);
}

}  // namespace
}  // namespace lightwell::test
