#include "reference/image_object/object_renderer.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace lightwell::reference {
namespace {

constexpr int kSide = 48;

const ObjectRenderer& renderer() {
  static const ObjectRenderer kRenderer;
  return kRenderer;
}

/// Whether a ray hits a triangle of the mesh (Moeller & Trumbore 1997), all tested.
bool hits_brute_force(const FigurineMesh& mesh, const V3& from, const V3& towards) {
  for (const auto& t : mesh.triangles) {
    const V3 ab = mesh.positions[t[1]] - mesh.positions[t[0]], ac = mesh.positions[t[2]] - mesh.positions[t[0]];
    const V3 p = cross(towards, ac);
    const double det = dot(ab, p);
    if (std::abs(det) < 1e-15) continue;
    const V3 s = from - mesh.positions[t[0]];
    const double u = dot(s, p) / det;
    const V3 q = cross(s, ab);
    const double v = dot(towards, q) / det, distance = dot(ac, q) / det;
    if (u >= 0 && v >= 0 && u + v <= 1 && distance > 0) return true;
  }
  return false;
}

TEST(ArcDirection, GoesFromRightOverTheCameraToTheLeft) {
  EXPECT_NEAR(arc_direction(0).x, 1, 1e-12);
  EXPECT_NEAR(arc_direction(180).x, -1, 1e-12);
  EXPECT_NEAR(arc_direction(90).y, std::sin(35 * pi / 180), 1e-12);
  EXPECT_GT(arc_direction(90).z, 0.8);
  for (int degrees = 0; degrees <= 180; degrees += 3) EXPECT_NEAR(length(arc_direction(degrees)), 1, 1e-12);
}

TEST(Figurine, LiesInsideTheSphereThatItsHeaderStates) {
  const FigurineMesh mesh = make_figurine();
  double radius = 0, shortest = 1;
  std::size_t without = 0;
  for (const V3& p : mesh.positions) radius = std::max(radius, length(p));
  for (const V3& n : mesh.normals) {
    if (length(n) == 0) ++without;
    if (length(n) > 0) shortest = std::min(shortest, length(n));
  }
  EXPECT_LT(radius, 1.25);
  EXPECT_NEAR(shortest, 1, 1e-9);
  EXPECT_EQ(without, 161U);
  EXPECT_EQ(mesh.parts.size(), mesh.triangles.size());
  EXPECT_EQ(mesh.normals.size(), mesh.positions.size());
}

TEST(ObjectRenderer, CoversPixelsWhoseRaysHitTheMesh) {
  const FigurineMesh mesh = make_figurine();
  const auto view = renderer().render({0.3, kSide, 1}, {});
  const double c = std::cos(-0.3), s = std::sin(-0.3);
  const auto turned = [&](const V3& a) { return V3{c * a.x + s * a.z, a.y, c * a.z - s * a.x}; };
  for (int pixel = 5; pixel < kSide * kSide; pixel += 97) {
    const double x = (pixel % kSide + 0.5) / kSide, y = (pixel / kSide + 0.5) / kSide;
    const V3 towards{ObjectRenderer::kHalfWidth * (2 * x - 1), ObjectRenderer::kHalfWidth * (1 - 2 * y),
                     -ObjectRenderer::kCameraDistance};
    const bool hit =
        hits_brute_force(mesh, turned({0, 0, ObjectRenderer::kCameraDistance}), turned(normalised(towards)));
    EXPECT_EQ(view.coverage[static_cast<std::size_t>(pixel)] > 0, hit) << pixel;
  }
}

TEST(ObjectRenderer, IsNotBrighterThanTheLightAllows) {
  const auto view = renderer().render({0, kSide, 2}, {{arc_direction(90), 0}});
  float brightest = 0;
  for (const auto& p : view.pictures[0].rgb) brightest = std::max(brightest, p[0]);
  // White has 0.8; the brightest albedo is 0.78 with 18 % of texture, and highlights come on top.
  EXPECT_GT(brightest, 0.4F);
  EXPECT_LT(brightest, 1.2F);
}

TEST(ObjectRenderer, ShowsALightOfSmallRadiusAsAPoint) {
  const auto view = renderer().render({0, kSide, 3}, {{arc_direction(60), 0}, {arc_direction(60), 1e-6}});
  double largest = 0;
  for (std::size_t p = 0; p < view.coverage.size(); ++p)
    for (std::size_t c = 0; c < 3; ++c)
      largest = std::max(largest, std::abs(double{view.pictures[0].rgb[p][c]} - double{view.pictures[1].rgb[p][c]}));
  EXPECT_LT(largest, 1e-4);
}

TEST(ObjectRenderer, SaysWherePixelsAreLit) {
  const auto view = renderer().render({0, kSide, 3}, {{arc_direction(20), 0}});
  std::array<int, 4> counts{};
  for (std::size_t p = 0; p < view.coverage.size(); ++p) {
    const bool black = view.pictures[0].rgb[p][1] == 0;
    EXPECT_EQ(view.pictures[0].light[p] == PixelLight::dark, black);
    ++counts[static_cast<std::size_t>(view.pictures[0].light[p])];
  }
  for (const int count : counts) EXPECT_GT(count, 20);
}

TEST(ObjectRenderer, TurnsTheObjectAndNotTheLight) {
  // Half a turn: what the light shows is the other side; the lit half of the picture stays on the light's side.
  const auto front = renderer().render({0, kSide, 1}, {{arc_direction(0), 0}});
  const auto back = renderer().render({pi, kSide, 1}, {{arc_direction(0), 0}});
  for (const auto* view : {&front, &back}) {
    double left = 0, right = 0;
    for (int p = 0; p < kSide * kSide; ++p)
      (p % kSide < kSide / 2 ? left : right) += view->pictures[0].rgb[static_cast<std::size_t>(p)][1] > 0;
    EXPECT_GT(right, left);
  }
}

}  // namespace
}  // namespace lightwell::reference
