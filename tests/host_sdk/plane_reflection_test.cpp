// Reflections of virtual objects against the reference ray tracer and closed forms; input that is hostile, empty or
// extreme.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/plane_reflection.hpp>

#include "host_sdk/reflection_scenes.hpp"
#include "host_sdk/shadow_casts.hpp"
#include "reference/reflection_tracer.hpp"
#include "support/captured_planes.hpp"

namespace lightwell::test {
namespace {

using reference::TriangleMesh;
using testing::HasSubstr;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();

struct Rendered {
  std::vector<Radiance> reflected;
  std::vector<float> hidden;
  PlaneReflection about;
};

/// A mesh of one radiance on a plane of 0.32 m.
struct Object {
  std::vector<Vec3f> positions;
  std::vector<std::uint32_t> indices;
  std::vector<Radiance> radiance;
  RadiancePer per = RadiancePer::vertex;
  PlaneGrid grid{{}, 0.32, 0.32, 32, 32};

  [[nodiscard]] RadiantMesh mesh() const { return {{positions, indices, {}}, radiance, per}; }
};

Object object_of(const TriangleMesh& mesh, Radiance radiance = {1, 2, 4}) {
  Object out;
  const Scene scene = scene_of(mesh, {});
  out.positions = scene.positions;
  out.indices = scene.indices;
  out.radiance.assign(out.positions.size(), radiance);
  return out;
}

PlaneReflector make_reflector(const ReflectionOptions& options = {}) {
  Result<PlaneReflector> made = PlaneReflector::make(options);
  EXPECT_TRUE(made.ok()) << made.status().message();
  return std::move(*made);
}

Rendered render(PlaneReflector& reflector, const PlaneAppearance& plane, const PlaneGrid& grid, const RadiantMesh& mesh,
                Vec3d eye) {
  const std::size_t texels = static_cast<std::size_t>(grid.columns) * static_cast<std::size_t>(grid.rows);
  Rendered out{std::vector<Radiance>(texels, {-1, -1, -1}), std::vector<float>(texels, -1), {}};
  const Result<PlaneReflection> about = reflector.render(plane, grid, mesh, eye, out.reflected, out.hidden);
  EXPECT_TRUE(about.ok()) << about.status().message();
  if (about.ok()) out.about = *about;
  for (std::size_t i = 0; i < texels; ++i) {
    if (!(out.hidden[i] >= 0 && out.hidden[i] <= 1)) ADD_FAILURE() << "a hidden share is " << out.hidden[i];
    for (int c = 0; c < 3; ++c)
      if (!(out.reflected[i][c] >= 0 && std::isfinite(out.reflected[i][c])))
        ADD_FAILURE() << "a radiance is " << out.reflected[i][c];
  }
  return out;
}

Rendered render(const PlaneAppearance& plane, const Object& object, Vec3d eye = {0, -0.3, 0.2}) {
  PlaneReflector reflector = make_reflector();
  return render(reflector, plane, object.grid, object.mesh(), eye);
}

float most_hidden(const Rendered& rendered) { return *std::ranges::max_element(rendered.hidden); }

bool nothing_in(const Rendered& rendered) {
  return most_hidden(rendered) == 0 &&
         std::ranges::all_of(rendered.reflected, [](Radiance r) { return r == Radiance{}; });
}

double largest_difference(const Rendered& a, const Rendered& b) {
  double out = 0;
  for (std::size_t i = 0; i < a.hidden.size(); ++i) {
    out = std::max(out, double{std::abs(a.hidden[i] - b.hidden[i])});
    for (int c = 0; c < 3; ++c) out = std::max(out, double{std::abs(a.reflected[i][c] - b.reflected[i][c])});
  }
  return out;
}

TriangleMesh ball_on_the_plane() { return reference::make_blob({0, 0, 0.04}, 0.04, 0, 16, 32); }

// ---- accuracy ----

TEST(PlaneReflector, AgreesWithTheRayTracer) {
  // Measured by measure_reflection with 10,000 triangles (host_sdk/README.md): 3 to 10 % of the RMS radiance, and a
  // third of the error of the sharp mirror image or less. The tracer's own error is about 1 % at 768 rays.
  for (const ReflectionCaseOptions& options : reflection_cases(2000)) {
    SCOPED_TRACE(options.name);
    const ReflectionCase test_case = make_reflection_case(options);
    const PlaneGrid grid = ReflectionCase::grid(256);
    PlaneReflector reflector = make_reflector();
    const Rendered rendered = render(reflector, test_case.plane, grid, test_case.object(), test_case.eye);
    const auto truth = trace_reflection(test_case, grid, 40, 768);
    ASSERT_EQ(truth.size(), 40U);
    const ReflectionErrors errors = reflection_errors(truth, grid, rendered.reflected, rendered.hidden);
    EXPECT_LT(errors.rms, 0.2);
    EXPECT_LT(errors.rms, 0.55 * errors.sharp_rms);
    EXPECT_LT(errors.hidden_rms, 0.06);
  }
}

TEST(PlaneReflector, ACeilingHidesTheWholeRoom) {
  // From all texels the ceiling of 4 km covers the lobe but for its grazing part.
  for (const float alpha : {0.01F, 0.1F}) {
    const Object object = object_of(reference::make_box({-2000, -2000, 0.5}, {2000, 2000, 0.6}, 20));
    const Vec3d eye{0, -0.3, 0.4};
    const Rendered rendered = render(glossy_plane(alpha), object, eye);
    const reference::ReflectionTracer tracer({}, {double{alpha}});
    for (int row = 0; row < 32; row += 5)
      for (int column = 0; column < 32; column += 5) {
        const std::size_t at = static_cast<std::size_t>(32 * row + column);
        const Vec3d point{(column + 0.5) * 0.01 - 0.16, 0.16 - (row + 0.5) * 0.01, 0};
        const double albedo = tracer.albedo(normalized(eye - point).z);
        // The sum over surfels that are half as large as the lobe.
        EXPECT_NEAR(rendered.hidden[at], 1, 0.04) << alpha;
        EXPECT_NEAR(rendered.reflected[at].g, 2 * albedo, 0.04 * 2 * albedo) << alpha;
      }
  }
}

TEST(PlaneReflector, IsSharpAtTheContactAndBlurredWithDistance) {
  // A wall whose foot is on the line y = 0; the eye is before it. Its mirror image ends at the foot; from there to 90 %
  // of the blur takes as many texels as the lobe is wide at the wall's height.
  Object object = object_of(quad({-0.3, 0, 0}, {0.3, 0, 0}, {0.3, 0, 0.1}, {-0.3, 0, 0.1}));
  object.grid = {{}, 0.32, 0.32, 256, 256};
  const Rendered rendered = render(glossy_plane(0.05F), object, {0, -0.5, 0.25});
  const auto hidden_at = [&](double y) {
    return rendered.hidden[static_cast<std::size_t>((0.16 - y) / 0.32 * 256) * 256 + 128];
  };
  // 1.5 texels on either side of the foot, which is the limit of the grid.
  EXPECT_GT(hidden_at(-0.002), 0.8F);
  EXPECT_LT(hidden_at(+0.002), 0.2F);
  // The upper edge is mirrored at y = -0.5 * 0.1 / 0.35; there half of the lobe is covered, and 2 cm away some of it.
  const double upper = -0.5 * 0.1 / 0.35;
  EXPECT_NEAR(hidden_at(upper), 0.5, 0.1);
  EXPECT_GT(hidden_at(upper - 0.01), 0.1F);
  EXPECT_LT(hidden_at(upper + 0.01), 0.9F);
}

TEST(PlaneReflector, AMirrorShowsTheMirrorImage) {
  // Alpha 0: the object's share is 1 inside its mirror image and 0 outside.
  const double height = 0.05;
  const Object object = object_of(sheet(-0.04, -0.04, 0.04, 0.04, height));
  const Vec3d eye{0, -0.3, 0.2};
  const Rendered rendered = render(glossy_plane(0.0F), object, eye);
  const double s = height / (height + eye.z);
  const reference::ReflectionTracer tracer({}, {0.005});
  for (int row = 0; row < 32; ++row)
    for (int column = 0; column < 32; ++column) {
      const double x = (column + 0.5) * 0.01 - 0.16, y = 0.16 - (row + 0.5) * 0.01;
      // The point of the sheet that is seen.
      const double px = (x - eye.x * s) / (1 - s), py = (y - eye.y * s) / (1 - s);
      const double outside = std::max(std::abs(px), std::abs(py)) - 0.04;
      if (std::abs(outside) < 0.008) continue;
      const std::size_t at = static_cast<std::size_t>(32 * row + column);
      const double albedo = tracer.albedo(normalized(eye - Vec3d{x, y, 0}).z);
      // A texel from the edge, the tail of a lobe that is as wide as a texel remains.
      EXPECT_NEAR(rendered.hidden[at], outside < 0 ? 1 : 0, 0.05);
      EXPECT_NEAR(rendered.reflected[at].b, outside < 0 ? 4 * albedo : 0, 0.05 * 4 * albedo);
    }
}

// ---- arguments and their meaning ----

TEST(PlaneReflector, RadianceOfTrianglesAndOfVerticesAgreeWhereItIsUniform) {
  Object object = object_of(ball_on_the_plane());
  const PlaneAppearance plane = glossy_plane(0.1F);
  const Rendered by_vertex = render(plane, object);
  EXPECT_GT(most_hidden(by_vertex), 0.5F);
  object.per = RadiancePer::triangle;
  object.radiance.assign(object.indices.size() / 3, {1, 2, 4});
  // 1e-5: sums of floats.
  EXPECT_LT(largest_difference(render(plane, object), by_vertex), 1e-5);
}

TEST(PlaneReflector, TheRadianceOfATriangleIsItsOwn) {
  Object object = object_of(reference::joined(sheet(-0.05, -0.05, 0, 0.05, 0.02), sheet(0, -0.05, 0.05, 0.05, 0.02)));
  object.per = RadiancePer::triangle;
  object.radiance = {{1, 0, 0}, {1, 0, 0}, {0, 0, 1}, {0, 0, 1}};
  const Rendered rendered = render(glossy_plane(0.01F), object);
  // Columns beside x = 0; the mirror image of the middle of the sheets is at y = -0.027.
  const Radiance left = rendered.reflected[18 * 32 + 13], right = rendered.reflected[18 * 32 + 18];
  EXPECT_GT(left.r, 20 * left.b);
  EXPECT_GT(right.b, 20 * right.r);
}

TEST(PlaneReflector, TheMeshMayBePosed) {
  const Object object = object_of(reference::make_box({-0.02, -0.03, 0.01}, {0.04, 0.02, 0.06}, 4));
  const PlaneAppearance plane = glossy_plane(0.1F);
  const Pose T_plane_mesh{Quat::about({0, 0, 1}, 0.5), {0.02, -0.01, 0.005}};
  RadiantMesh posed = object.mesh();
  posed.mesh.T_plane_mesh = T_plane_mesh;
  Object moved = object;
  for (Vec3f& p : moved.positions) p = vec_cast<float>(transformed(T_plane_mesh, vec_cast<double>(p)));
  PlaneReflector reflector = make_reflector();
  const Rendered a = render(reflector, plane, object.grid, posed, {0, -0.3, 0.2});
  EXPECT_GT(most_hidden(a), 0.5F);
  // 1e-3: rounded positions move the edges of pixels.
  EXPECT_LT(largest_difference(a, render(plane, moved)), 1e-3);
}

TEST(PlaneReflector, APartOfTheGridShowsTheSame) {
  Object object = object_of(ball_on_the_plane());
  object.grid = {{}, 0.32, 0.32, 128, 128};
  const PlaneAppearance plane = glossy_plane(0.1F);
  const Rendered whole = render(plane, object);
  object.grid = {{-0.08, -0.08}, 0.16, 0.16, 64, 64};
  const Rendered part = render(plane, object);
  double largest = 0;
  for (std::size_t row = 0; row < 64; ++row)
    for (std::size_t column = 0; column < 64; ++column)
      largest =
          std::max(largest, double{std::abs(part.hidden[64 * row + column] - whole.hidden[128 * (row + 64) + column])});
  // The pixels outside the grid are larger, 6 % of their distance from it.
  EXPECT_LT(largest, 0.05);
  EXPECT_GT(most_hidden(part), 0.8F);
}

TEST(PlaneReflector, FineAndCoarseGridsAgree) {
  // Above 512 texels a texel has one pixel instead of four.
  Object object = object_of(ball_on_the_plane());
  const PlaneAppearance plane = glossy_plane(0.1F);
  object.grid = {{}, 0.32, 0.32, 640, 160};
  const Rendered fine = render(plane, object);
  object.grid.columns = 320;
  const Rendered coarse = render(plane, object);
  double squares = 0;
  for (std::size_t at = 0; at < coarse.hidden.size(); ++at) {
    const double mean = (double{fine.hidden[2 * at]} + double{fine.hidden[2 * at + 1]}) / 2;
    squares += std::pow(mean - double{coarse.hidden[at]}, 2);
  }
  // Other squares of pixels are summed as one, and near the contact the lobe is as wide as a pixel.
  EXPECT_LT(std::sqrt(squares / static_cast<double>(coarse.hidden.size())), 0.01);
  EXPECT_GT(most_hidden(coarse), 0.9F);
}

TEST(PlaneReflector, AReusedReflectorAnswersAsANewOne) {
  const PlaneAppearance glossy = glossy_plane(0.1F), rough = glossy_plane(0.4F, 0.1F);
  const Object ball = object_of(ball_on_the_plane()),
               box = object_of(reference::make_box({0, 0, 0}, {0.05, 0.05, 0.1}, 3));
  Object small = ball;
  small.grid.columns = small.grid.rows = 20;
  PlaneReflector reflector = make_reflector();
  for (int round = 0; round < 2; ++round)
    for (const Object& object : {ball, small, box, object_of({})})
      for (const PlaneAppearance& plane : {glossy, rough})
        EXPECT_EQ(largest_difference(render(reflector, plane, object.grid, object.mesh(), {0, -0.3, 0.2}),
                                     render(plane, object)),
                  0);
}

// ---- extremes ----

TEST(PlaneReflector, OfAMattePlaneIsZeroAndSaysSo) {
  const Object object = object_of(ball_on_the_plane());
  for (const PlaneAppearance& plane : {glossy_plane({}), PlaneAppearance()}) {
    const Rendered rendered = render(plane, object);
    EXPECT_EQ(rendered.about.validity, Validity::none);
    EXPECT_TRUE(nothing_in(rendered));
  }
}

TEST(PlaneReflector, AssumesTheReflectanceThatIsNotSent) {
  const Object object = object_of(ball_on_the_plane());
  const Rendered assumed = render(glossy_plane(0.1F, {}), object), sent = render(glossy_plane(0.1F, 0.04F), object);
  EXPECT_TRUE(assumed.about.f0_assumed);
  EXPECT_FALSE(sent.about.f0_assumed);
  EXPECT_EQ(sent.about.validity, Validity::valid);
  // The wire rounds neither 0.04 nor alpha.
  EXPECT_LT(largest_difference(assumed, sent), 1e-6);
}

TEST(PlaneReflector, AnEyeThatIsNotInFrontIsAnInvalidQuery) {
  const Object object = object_of(ball_on_the_plane());
  const PlaneAppearance plane = glossy_plane(0.1F);
  const double nan = double{kNan}, inf = double{kInf};
  for (const Vec3d eye : {Vec3d{0, -0.3, 0}, Vec3d{0, -0.3, -0.1}, Vec3d{0, nan, 0.1}, Vec3d{0, 0, inf}}) {
    const Rendered rendered = render(plane, object, eye);
    EXPECT_EQ(rendered.about.validity, Validity::invalid_query);
    EXPECT_TRUE(nothing_in(rendered));
  }
}

TEST(PlaneReflector, ExtremeEyesGiveNumbers) {
  // render() checks every value. Grazing, near, inside the object, and far away.
  const Object object =
      object_of(reference::joined(ball_on_the_plane(), reference::make_box({0, 0, -1}, {0.3, 0.1, 2}, 3)));
  for (const float alpha : {0.0F, 1e-6F, 0.03F, 1.0F})
    for (const Vec3d eye : {Vec3d{0, -0.3, 1e-3}, Vec3d{0, -0.3, 1e-12}, Vec3d{0, -0.3, 1e-300}, Vec3d{0, 0, 0.04},
                            Vec3d{0, 0, 1e-9}, Vec3d{0, -1e9, 1}, Vec3d{1e300, 0, 1e300}, Vec3d{0, 0, 1e20}})
      EXPECT_EQ(render(glossy_plane(alpha), object, eye).about.validity, Validity::valid);
}

TEST(PlaneReflector, AFarEyeSeesTheLimit) {
  const Object object = object_of(ball_on_the_plane());
  const PlaneAppearance plane = glossy_plane(0.1F);
  const Vec3d direction = normalized(Vec3d{0, -0.5, 0.5});
  const Rendered far = render(plane, object, direction * 1e4);
  EXPECT_GT(most_hidden(far), 0.5F);
  // 1e-3: directions differ by 0.3 m / 10 km.
  EXPECT_LT(largest_difference(far, render(plane, object, direction * 1e9)), 1e-3);
}

TEST(PlaneReflector, NothingBelowThePlaneIsReflected) {
  const PlaneAppearance plane = glossy_plane(0.1F);
  EXPECT_TRUE(nothing_in(render(plane, object_of(reference::make_box({-0.05, -0.05, -0.2}, {0.05, 0.05, -0.01}, 3)))));
  const Rendered sunk = render(plane, object_of(reference::make_box({-0.05, -0.05, -0.2}, {0.05, 0.05, 0.04}, 3)));
  const Rendered standing = render(plane, object_of(reference::make_box({-0.05, -0.05, 0}, {0.05, 0.05, 0.04}, 3)));
  EXPECT_GT(most_hidden(sunk), 0.5F);
  // Not in texels under the box, which no eye sees: one of the two boxes has a floor. They are in columns and rows 11
  // to 20.
  double largest = 0, sum = 0;
  for (std::size_t row = 0; row < 32; ++row)
    for (std::size_t column = 0; column < 32; ++column) {
      if (row >= 11 && row <= 20 && column >= 11 && column <= 20) continue;
      const std::size_t at = 32 * row + column;
      const double difference = std::abs(double{sunk.hidden[at]} - double{standing.hidden[at]});
      largest = std::max(largest, difference);
      sum += difference;
    }
  // One of the four pixels of a texel at an edge. A part of the inside of the box would be seen in ten rows before it.
  EXPECT_LT(largest, 0.26);
  EXPECT_LT(sum, 0.5);
}

TEST(PlaneReflector, WithoutAnObjectNothingIsHidden) {
  const Rendered rendered = render(glossy_plane(0.1F), object_of({}));
  EXPECT_TRUE(nothing_in(rendered));
  EXPECT_EQ(rendered.about.validity, Validity::valid);
  EXPECT_EQ(rendered.about.texels, 0U);
}

TEST(PlaneReflector, TrianglesWithVerticesThatAreNoNumbersAreIgnored) {
  Object object = object_of(ball_on_the_plane());
  const PlaneAppearance plane = glossy_plane(0.1F);
  const Rendered plain = render(plane, object);
  object.positions.insert(object.positions.end(), {{kNan, 0, 0.1F}, {0, kInf, 0.1F}, {0, 0, -kInf}, {1e30F, 0, 0.1F}});
  object.radiance.resize(object.positions.size());
  const auto first = static_cast<std::uint32_t>(object.positions.size() - 4);
  for (std::uint32_t k = 0; k < 4; ++k) object.indices.insert(object.indices.end(), {0, 5, first + k});
  const Rendered rendered = render(plane, object);
  EXPECT_EQ(rendered.about.ignored_triangles, 4U);
  EXPECT_EQ(largest_difference(rendered, plain), 0);
}

TEST(PlaneReflector, DegenerateTrianglesReflectNothing) {
  Object object = object_of(ball_on_the_plane());
  const PlaneAppearance plane = glossy_plane(0.1F);
  const Rendered plain = render(plane, object);
  const auto first = static_cast<std::uint32_t>(object.positions.size());
  object.positions.insert(object.positions.end(), {{-0.1F, 0, 0.1F}, {0, 0, 0.1F}, {0.1F, 0, 0.1F}});
  object.radiance.resize(object.positions.size(), {9, 9, 9});
  object.indices.insert(object.indices.end(), {first, first, first + 2, first, first + 1, first + 2, 2, 2, 2});
  const Rendered rendered = render(plane, object);
  // 0.02: their vertices extend the image, and with it the squares of pixels that are summed as one.
  EXPECT_LT(largest_difference(rendered, plain), 0.02);
  EXPECT_EQ(rendered.about.ignored_triangles, 0U);
}

TEST(PlaneReflector, RadianceThatIsNoLightCountsAsNone) {
  Object object = object_of(ball_on_the_plane());
  object.radiance.assign(object.positions.size(), {kNan, -3, kInf});
  const Rendered rendered = render(glossy_plane(0.1F), object);
  float red = 0, blue = 0;
  for (const Radiance& r : rendered.reflected) {
    red = std::max({red, r.r, r.g});
    blue = std::max(blue, r.b);
  }
  EXPECT_EQ(red, 0);
  EXPECT_GT(blue, 1e27F);
}

TEST(PlaneReflector, ArgumentsAreChecked) {
  const Object good = object_of(sheet(-0.05, -0.05, 0.05, 0.05, 0.1));
  const PlaneAppearance plane = glossy_plane(0.1F);
  PlaneReflector reflector = make_reflector();
  const auto refusal = [&](const PlaneGrid& grid, const RadiantMesh& mesh, std::size_t texels, std::size_t shares) {
    std::vector<Radiance> reflected(texels, {-1, -1, -1});
    std::vector<float> hidden(shares, -1);
    const Status status = reflector.render(plane, grid, mesh, {0, 0, 1}, reflected, hidden).status();
    EXPECT_EQ(status.code(), StatusCode::invalid_argument);
    for (const Radiance& r : reflected) EXPECT_EQ(r, (Radiance{-1, -1, -1}));
    for (const float h : hidden) EXPECT_EQ(h, -1);
    return status.message();
  };
  const auto of_grid = [&](const PlaneGrid& grid) { return refusal(grid, good.mesh(), 1024, 1024); };
  EXPECT_THAT(of_grid({{}, 0, 0.3, 32, 32}), HasSubstr("from 1e-6 to 1e6"));
  EXPECT_THAT(of_grid({{}, 0.3, double{kNan}, 32, 32}), HasSubstr("from 1e-6 to 1e6"));
  EXPECT_THAT(of_grid({{double{kInf}, 0}, 0.3, 0.3, 32, 32}), HasSubstr("PlaneGrid::centre"));
  EXPECT_THAT(of_grid({{}, 0.3, 0.3, 0, 32}), HasSubstr("PlaneGrid::columns"));
  EXPECT_THAT(of_grid({{}, 0.3, 0.3, 32, 1025}), HasSubstr("PlaneGrid::rows"));
  EXPECT_THAT(of_grid({{}, 1000, 0.3, 32, 32}), HasSubstr("times as wide as high"));
  EXPECT_THAT(refusal(good.grid, good.mesh(), 5, 1024), HasSubstr("reflected radiance has 5"));
  EXPECT_THAT(refusal(good.grid, good.mesh(), 1024, 7), HasSubstr("hidden shares has 7"));
  Object bad = good;
  bad.indices[4] = 4;
  EXPECT_THAT(refusal(bad.grid, bad.mesh(), 1024, 1024), HasSubstr("index 4 is out of range"));
  bad = good;
  bad.radiance.pop_back();
  EXPECT_THAT(refusal(bad.grid, bad.mesh(), 1024, 1024), HasSubstr("has 3 elements; the mesh has 4 vertices"));
  bad.per = RadiancePer::triangle;
  EXPECT_THAT(refusal(bad.grid, bad.mesh(), 1024, 1024), HasSubstr("has 3 elements; the mesh has 2 triangles"));
  RadiantMesh mesh = good.mesh();
  mesh.mesh.T_plane_mesh.rotation = {0, 0, 0, 0};
  EXPECT_THAT(refusal(good.grid, mesh, 1024, 1024), HasSubstr("T_plane_mesh"));
  for (const ReflectionOptions& options : {ReflectionOptions{0.05, 4}, ReflectionOptions{double{kNan}, 4},
                                           ReflectionOptions{0.5, 0}, ReflectionOptions{0.5, 17}})
    EXPECT_EQ(PlaneReflector::make(options).status().code(), StatusCode::invalid_argument);
}

}  // namespace
}  // namespace lightwell::test
