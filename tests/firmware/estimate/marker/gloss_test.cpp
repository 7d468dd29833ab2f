// Specular reflection, measured on black ink and subtracted from irradiances, on faces of known diffuse and specular
// radiance.
#include "estimate/marker/gloss.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace lightwell::marker {
namespace {

constexpr double kPaper = 0.8, kInk = 0.04;
constexpr double kSigma = 0.01;
/// Relative irradiance of the two samples of a face; their mean is 1.
constexpr double kUnequal[] = {0.9, 1.1};
/// Relative standard deviation of a specular reflection.
constexpr double kGlossSigma = 0.7;

struct Face {
  Rgb irradiance;       ///< Diffuse, mean over the face.
  double specular = 0;  ///< Specular radiance, as a share of the radiance of a white face of the same irradiance.
  bool inked = true;
  double paper = kPaper, ink = kInk;
};

/// Share of the sampled irradiance that is specular: E' = E + pi s / a, with s = specular * E / pi.
double specular_share(const Face& face) { return face.specular / face.paper / (1 + face.specular / face.paper); }

Shading shading_of(const std::vector<Face>& faces) {
  Shading out;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const Face& face = faces[f];
    for (const double relative : kUnequal) {
      SurfaceSample s;
      s.surface = static_cast<int>(f);
      for (std::size_t c = 0; c < 3; ++c) {
        // The specular radiance is the same over the face.
        s.irradiance[c] = face.irradiance[c] * (relative + face.specular / face.paper);
        s.sigma[c] = kSigma;
      }
      out.samples.push_back(s);
    }
    if (!face.inked) continue;
    const double radiance = luminance(face.irradiance) * (face.ink + face.specular) / std::numbers::pi;
    out.ink.push_back({.surface = static_cast<int>(f), .radiance = radiance, .paper_albedo = face.paper});
  }
  return out;
}

Shading without_gloss(Shading shading) {
  subtract_gloss(shading);
  return shading;
}

/// Whether each irradiance is as in `before`. Relative tolerance 1e-14: rounding of the inks' albedos.
void expect_unchanged(const Shading& after, const Shading& before, const char* what) {
  ASSERT_EQ(after.samples.size(), before.samples.size()) << what;
  for (std::size_t i = 0; i < after.samples.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      const double e = before.samples[i].irradiance[c];
      EXPECT_NEAR(after.samples[i].irradiance[c], e, 1e-14 * e) << what << ", sample " << i;
      EXPECT_NEAR(after.samples[i].sigma[c], before.samples[i].sigma[c], 1e-14) << what << ", sample " << i;
    }
}

TEST(Gloss, MatteFacesKeepTheirIrradiance) {
  for (const double ink : {0.0, 0.02, kInk, kMaxInkAlbedo}) {
    std::vector<Face> faces;
    for (const double e : {1.0, 3.0, 0.2}) faces.push_back({.irradiance = {e, 0.7 * e, 0.5 * e}, .ink = ink});
    const Shading before = shading_of(faces);
    expect_unchanged(without_gloss(before), before, "equal inks");
  }
}

TEST(Gloss, FaceWithTheSmallestInkIsUnchangedToTheLastBit) {
  const Shading before = shading_of({{.irradiance = {1, 1, 1}, .specular = 0.1},
                                     {.irradiance = {0.3, 0.7, 0.9}},
                                     {.irradiance = {2, 1, 1}, .specular = 0.02}});
  const Shading after = without_gloss(before);
  for (const std::size_t i : {2U, 3U}) {
    EXPECT_EQ(after.samples[i].irradiance, before.samples[i].irradiance);
    EXPECT_EQ(after.samples[i].sigma, before.samples[i].sigma);
  }
}

TEST(Gloss, SpecularRadianceIsSubtractedAndWidensSigma) {
  const std::vector<Face> faces = {{.irradiance = {1, 0.6, 0.3}},
                                   {.irradiance = {1, 0.6, 0.3}, .specular = 0.05},
                                   {.irradiance = {0.2, 0.2, 0.4}, .specular = 0.5},
                                   {.irradiance = {3, 3, 3}, .specular = 0.01},
                                   {.irradiance = {1, 1, 1}, .specular = 0.1, .paper = 0.4}};
  const Shading after = without_gloss(shading_of(faces));
  for (std::size_t i = 0; i < after.samples.size(); ++i) {
    const SurfaceSample& s = after.samples[i];
    const Face& face = faces[static_cast<std::size_t>(s.surface)];
    for (std::size_t c = 0; c < 3; ++c) {
      // 1e-12: rounding.
      EXPECT_NEAR(s.irradiance[c], face.irradiance[c] * kUnequal[i % 2], 1e-12) << "face " << s.surface;
      EXPECT_NEAR(s.sigma[c], std::hypot(kSigma, kGlossSigma * face.specular / face.paper * face.irradiance[c]), 1e-12)
          << "face " << s.surface;
    }
  }
}

TEST(Gloss, InkIsAtMostAsBrightAsPrintedInk) {
  // All faces reflect: the smallest apparent albedo is 0.145, and only 0.045 of it can be ink.
  const Face face{.irradiance = {1, 1, 1}, .specular = 0.1, .ink = kMaxInkAlbedo};
  for (const std::size_t count : {1U, 3U})
    for (const SurfaceSample& s : without_gloss(shading_of(std::vector<Face>(count, face))).samples)
      EXPECT_NEAR(s.irradiance[1], 1, 0.1 + 1e-12) << count << " faces; samples vary by 0.1";
  double sum = 0;
  for (const SurfaceSample& s : without_gloss(shading_of({face})).samples) sum += s.irradiance[1] / 2;
  EXPECT_NEAR(sum, 1, 1e-12);
}

TEST(Gloss, FacesWithoutInkAreWidenedByTheMedianShare) {
  const std::vector<Face> faces = {{.irradiance = {1, 1, 1}},
                                   {.irradiance = {1, 1, 1}, .specular = 0.05},
                                   {.irradiance = {1, 1, 1}, .specular = 0.4},
                                   {.irradiance = {1, 0.5, 2}, .inked = false}};
  const Shading before = shading_of(faces), after = without_gloss(before);
  for (const std::size_t i : {6U, 7U}) {
    EXPECT_EQ(after.samples[i].irradiance, before.samples[i].irradiance);
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(after.samples[i].sigma[c],
                  std::hypot(kSigma, specular_share(faces[1]) * before.samples[i].irradiance[c]), 1e-12);
  }
}

TEST(Gloss, UnusableInkIsIgnored) {
  const Shading matte = shading_of({{.irradiance = {1, 1, 1}}, {.irradiance = {2, 2, 2}, .specular = 0.1}});
  const auto with = [&](const auto& change) {
    Shading out = matte;
    for (InkSample& ink : out.ink) change(ink);
    return out;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  for (const auto& [what, shading] :
       {std::pair{"none",
                  [&] {
                    Shading s = matte;
                    s.ink.clear();
                    return s;
                  }()},
        std::pair{"a face that has no samples", with([](InkSample& i) { i.surface += 7; })},
        std::pair{"grey paper", with([](InkSample& i) { i.paper_albedo = 2 * kMaxInkAlbedo; })},
        std::pair{"noise", with([](InkSample& i) { i.sigma = 0.1; })},
        std::pair{"sigma NaN", with([&](InkSample& i) { i.sigma = nan; })},
        std::pair{"radiance NaN", with([&](InkSample& i) { i.radiance = nan; })},
        std::pair{"radiance infinite", with([&](InkSample& i) { i.radiance = infinity; })},
        std::pair{"albedo NaN", with([&](InkSample& i) { i.paper_albedo = nan; })}})
    expect_unchanged(without_gloss(shading), shading, what);
}

TEST(Gloss, NothingBecomesNegativeOrNotANumber) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  const std::vector<Face> faces = {
      {.irradiance = {1, 1, 1}}, {.irradiance = {2, 1, 0}, .specular = 0.1}, {.irradiance = {1, 1, 1}, .inked = false}};
  for (std::size_t bad = 0; bad < 2; ++bad)
    for (const double radiance : {nan, infinity, -1.0, -1e-3, 0.0, 1e-300, 0.3, 1e6}) {
      Shading shading = shading_of(faces);
      shading.ink[bad].radiance = radiance;
      shading.samples[0].irradiance = {};  // of a face whose other sample is lit
      for (const SurfaceSample& s : without_gloss(shading).samples)
        for (std::size_t c = 0; c < 3; ++c) {
          EXPECT_GE(s.irradiance[c], 0) << "ink " << bad << " of radiance " << radiance;
          EXPECT_GE(s.sigma[c], kSigma) << "ink " << bad << " of radiance " << radiance;
          EXPECT_TRUE(std::isfinite(s.irradiance[c]) && std::isfinite(s.sigma[c])) << radiance;
        }
    }
}

TEST(Gloss, WithMoreSpecularLightThanLightNothingOfTheMeanRemains) {
  Shading before = shading_of({{.irradiance = {1, 1, 1}}, {.irradiance = {2, 1, 0}}});
  before.ink[1].radiance = 10;
  const Shading after = without_gloss(before);
  for (const std::size_t c : {0U, 1U, 2U}) {
    const double mean = (before.samples[2].irradiance[c] + before.samples[3].irradiance[c]) / 2;
    EXPECT_EQ(after.samples[2].irradiance[c], 0) << "darker than the mean of its face";
    // 1e-12: rounding.
    EXPECT_NEAR(after.samples[3].irradiance[c], before.samples[3].irradiance[c] - mean, 1e-12);
  }
}

TEST(Gloss, BlackFacesStayBlack) {
  Shading shading = shading_of({{.irradiance = {0, 0, 0}}, {.irradiance = {1, 1, 1}, .specular = 0.1}});
  shading.ink[0].radiance = 0;
  for (const SurfaceSample& s : without_gloss(shading).samples)
    if (s.surface == 0) {
      EXPECT_EQ(s.irradiance, (Rgb{0, 0, 0}));
    }
}

}  // namespace
}  // namespace lightwell::marker
