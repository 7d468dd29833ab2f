// Accuracy of detected corners in rendered pictures.
#include <array>
#include <cmath>
#include <iostream>
#include <vector>

#include <gtest/gtest.h>

#include "calibration/model/response.hpp"
#include "firmware/pose/tags_around.hpp"
#include "pose/tag_detector.hpp"

namespace lightwell {
namespace {

using test::add_ring;
using test::BoardCamera;
using test::BoardPicture;
using test::CornerErrors;
using test::errors_of;
using test::PictureOptions;
using test::PlacedBoard;
using test::TrueTag;

constexpr Pose kOrigin;

std::vector<TagDetection> detect(const BoardPicture& picture, const TagDetectorOptions& options = {},
                                 const CameraModel* lens = nullptr) {
  auto detector = TagDetector::make(options);
  EXPECT_TRUE(detector) << detector.status().message();
  auto tags = detector->detect(picture.view(), lens);
  EXPECT_TRUE(tags) << tags.status().message();
  return *tags;
}

/// Tags of 30 to 50 px all over the field of view; the square of tagStandard41h12 is a smaller part of the paper.
std::vector<PlacedBoard> many_tags(TagFamily family = TagFamily::tag36h11) {
  std::vector<PlacedBoard> boards;
  const double part = family == TagFamily::tag36h11 ? 1 : 0.65;
  add_ring(boards, 14, 4, 0.14 * part, 25, family);
  add_ring(boards, 32, 8, 0.17 * part, 30, family);
  add_ring(boards, 54, 12, 0.19 * part, 20, family);
  add_ring(boards, 76, 14, 0.2 * part, 10, family);
  return boards;
}

void report(const char* what, const CornerErrors& e) {
  std::cout << what << ": " << e.corners << " corners, RMS " << e.rms() << " px a coordinate, mean ("
            << e.sum_x / e.corners << ", " << e.sum_y / e.corners << "), largest " << e.largest << ", e'C^-1 e / 2 "
            << (e.refined ? e.normalized / (2 * e.refined) : 0) << "\n";
}

TEST(TagAccuracy, TheTopLeftPixelsCentreIsTheOrigin) {
  // A narrow lens, in which edges are straight, so that AprilTag's own corners have their best accuracy.
  const BoardCamera camera(test::fisheye_lens(800, 36));
  std::vector<PlacedBoard> boards;
  add_ring(boards, 3.5, 4, 0.035, 20);
  add_ring(boards, 8, 8, 0.04, 20);
  add_ring(boards, 13, 12, 0.04, 20);
  for (const bool refine : {false, true}) {
    CornerErrors all;
    TagDetectorOptions options;
    options.corners = refine ? CornerRefinement::edge_fit : CornerRefinement::none;
    // The probe moves a little between pictures, so that corners fall at different subpixel positions.
    for (int i = 0; i < 3; ++i) {
      PictureOptions picture_options;
      picture_options.seed = static_cast<std::uint64_t>(i) + 1;
      Pose probe;
      probe.translation = {0.0013 * i, 0.0007 * i, 0};
      const BoardPicture picture = camera.take(probe, boards, picture_options);
      const CornerErrors e = errors_of(detect(picture, options), picture);
      all.corners += e.corners;
      all.sum_x += e.sum_x;
      all.sum_y += e.sum_y;
      all.squares += e.squares;
    }
    report(refine ? "refined" : "AprilTag's own", all);
    ASSERT_GT(all.corners, 250);
    // Errors of edge positions cancel in the mean over all corners; a wrong pixel convention of half a pixel does not.
    EXPECT_LT(std::abs(all.sum_x / all.corners), 0.02) << "refined: " << refine;
    EXPECT_LT(std::abs(all.sum_y / all.corners), 0.02) << "refined: " << refine;
  }
}

TEST(TagAccuracy, RefinedCornersAreWithinATwentiethOfAPixelForEachLensModel) {
  const std::array<std::pair<const char*, LensParameters>, 2> lenses = {
      {{"Kannala-Brandt", test::fisheye_lens(800)}, {"double sphere", test::double_sphere_lens(800)}}};
  for (const auto& [name, lens] : lenses) {
    const BoardCamera camera(lens);
    for (const TagFamily family : {TagFamily::tag36h11, TagFamily::tagStandard41h12}) {
      TagDetectorOptions options;
      options.families = {family};
      const auto boards = many_tags(family);
      const BoardPicture picture = camera.take(kOrigin, boards);
      const auto tags = detect(picture, options);
      const CornerErrors e = errors_of(tags, picture);
      report(name, e);
      EXPECT_GE(tags.size(), boards.size() - 1) << to_string(family);
      EXPECT_GE(e.refined, 0.95 * e.corners);
      EXPECT_LT(e.rms(), 0.05) << to_string(family) << "; the requirement is 0.2 px";
      // 1 for a consistent covariance.
      EXPECT_GT(e.normalized / (2 * e.refined), 0.4);
      EXPECT_LT(e.normalized / (2 * e.refined), 2.5);
    }
  }
}

TEST(TagAccuracy, BlurNoiseAndFalloffHaveLittleEffect) {
  LensParameters lens = test::fisheye_lens(800);
  lens.photometry.vignetting = {-0.2, 0.01, 0};
  const BoardCamera camera(lens);
  struct Case {
    const char* name;
    PictureOptions options;
    double rms_px;
  };
  PictureOptions sharp, soft, noisy, dim, falloff;
  sharp.blur_px = 0;
  soft.blur_px = 1.2;
  noisy.electrons = 800;
  noisy.read_noise_electrons = 8;
  dim.bright = 0.2;
  dim.dark = 0.02;
  dim.background = 0.1;
  falloff.falloff = true;
  for (const auto& [name, options, limit] :
       {Case{"sharp", sharp, 0.05}, Case{"soft", soft, 0.06}, Case{"noisy", noisy, 0.1}, Case{"dim", dim, 0.05},
        Case{"falloff", falloff, 0.05}}) {
    const BoardPicture picture = camera.take(kOrigin, many_tags(), options);
    const CornerErrors e = errors_of(detect(picture), picture);
    report(name, e);
    EXPECT_GE(e.corners, 4 * 34) << name;
    EXPECT_LT(e.rms(), limit) << name;
  }
}

TEST(TagAccuracy, TagsAppearSmallerInAnEncodedPictureThatIsNotLinearised) {
  const BoardCamera camera(test::fisheye_lens(800));
  PictureOptions encoded_options;
  encoded_options.srgb = true;
  const BoardPicture picture = camera.take(kOrigin, many_tags(), encoded_options);
  // By how much tags appear larger, px on each side.
  const auto growth = [&](const std::vector<TagDetection>& tags) {
    double sum = 0;
    int count = 0;
    for (const TagDetection& tag : tags) {
      const TrueTag* truth = picture.find(tag.family, tag.id);
      if (truth == nullptr || !tag.refined) continue;
      for (std::size_t k = 0; k < 2; ++k) {
        const auto diagonal = [&](const auto& c) { return std::hypot(c[k].x - c[k + 2].x, c[k].y - c[k + 2].y); };
        sum += (diagonal(tag.corners) - diagonal(truth->corners)) / 2 / std::sqrt(2.0);
        ++count;
      }
    }
    EXPECT_GT(count, 50);
    return sum / count;
  };
  TagDetectorOptions options;
  PhotometricCalibration photometry;
  photometry.response.kind = ResponseCurve::Kind::srgb;
  options.linear = linear_table(photometry, 256);
  const double plain = growth(detect(picture)), linearised = growth(detect(picture, options));
  std::cout << "sRGB: tags look " << plain << " px larger on each side, linearised " << linearised << "\n";
  EXPECT_LT(plain, -0.15) << "blur spreads light over the edge, and the encoding brightens the dark side";
  EXPECT_NEAR(linearised, 0, 0.02);
}

TEST(TagAccuracy, RefinesLargeTagsWithCurvedEdges) {
  const BoardCamera camera(test::fisheye_lens(800));
  std::vector<PlacedBoard> boards;
  // 30 degrees wide: about 140 px, with a curvature of several px.
  add_ring(boards, 60, 5, 0.54);
  const BoardPicture picture = camera.take(kOrigin, boards);
  const auto tags = detect(picture, {}, &camera.model());
  const CornerErrors e = errors_of(tags, picture);
  report("large", e);
  EXPECT_EQ(tags.size(), boards.size());
  EXPECT_EQ(e.refined, e.corners);
  EXPECT_LT(e.rms(), 0.1);
}

}  // namespace
}  // namespace lightwell
