// TagDetector: orientation, families, occlusion, invalid input.
#include "pose/tag_detector.hpp"

#include <limits>
#include <random>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/pose/tags_around.hpp"
#include "pose/corner_refiner.hpp"

namespace lightwell {
namespace {

using test::BoardCamera;
using test::BoardPicture;
using test::PlacedBoard;
using testing::HasSubstr;

constexpr Pose kOrigin;

TagDetector detector(const TagDetectorOptions& options = {}) {
  auto made = TagDetector::make(options);
  EXPECT_TRUE(made) << made.status().message();
  return std::move(*made);
}

const BoardCamera& camera() {
  static const BoardCamera it(test::fisheye_lens(400));
  return it;
}

/// A board of 2 x 2 tags straight ahead, rolled.
std::vector<PlacedBoard> board_ahead(double roll_rad) {
  TagBoard board;
  board.columns = board.rows = 2;
  board.tag_size_m = 0.2;
  return {test::board_facing(board, {0, 0, -0.5}, {0, 0, 1}, roll_rad)};
}

TEST(TagDetector, CornersStartAtTheTagsBottomLeftAtAnyRoll) {
  for (const double roll : {0.0, 0.4, 1.6, 3.1, 4.7}) {
    const BoardPicture picture = camera().take(kOrigin, board_ahead(roll));
    const auto tags = detector().detect(picture.view());
    ASSERT_TRUE(tags);
    ASSERT_EQ(tags->size(), 4u) << roll;
    test::errors_of(*tags, picture);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ((*tags)[i].id, static_cast<int>(i)) << "sorted by id";
  }
  const BoardPicture upright = camera().take(kOrigin, board_ahead(0));
  const auto tags = detector().detect(upright.view());
  const auto& c = (*tags)[0].corners;
  EXPECT_LT(c[0].x, c[1].x);
  EXPECT_GT(c[0].y, c[3].y) << "the bottom is a larger row";
}

TEST(TagDetector, AcceptsAStrideLargerThanTheWidth) {
  const BoardPicture picture = camera().take(kOrigin, board_ahead(0.2));
  const std::size_t stride = 417;
  std::vector<std::uint8_t> padded(stride * 400, 0xAA);
  for (std::size_t y = 0; y < 400; ++y)
    std::copy_n(picture.pixels.begin() + static_cast<std::ptrdiff_t>(y * 400), 400,
                padded.begin() + static_cast<std::ptrdiff_t>(y * stride));
  const auto plain = detector().detect(picture.view());
  // The last row may end without padding.
  const auto wide = detector().detect({std::span(padded).first(stride * 399 + 400), 400, 400, stride});
  ASSERT_TRUE(plain && wide);
  ASSERT_EQ(plain->size(), wide->size());
  for (std::size_t i = 0; i < plain->size(); ++i) EXPECT_EQ((*plain)[i].corners[2].x, (*wide)[i].corners[2].x);
}

TEST(TagDetector, DetectsSeveralFamiliesAtOnce) {
  std::vector<PlacedBoard> boards;
  boards.push_back(test::board_facing(test::single_tag(3, 0.25), {-0.3, 0, -0.6}, {0, 0, 1}));
  boards.push_back(
      test::board_facing(test::single_tag(3, 0.2, TagFamily::tagStandard41h12), {0.3, 0, -0.6}, {0, 0, 1}));
  const BoardPicture picture = camera().take(kOrigin, boards);
  TagDetectorOptions options;
  options.families = {TagFamily::tag36h11, TagFamily::tagStandard41h12};
  const auto tags = detector(options).detect(picture.view());
  ASSERT_TRUE(tags);
  ASSERT_EQ(tags->size(), 2u);
  EXPECT_EQ((*tags)[0].family, TagFamily::tag36h11);
  EXPECT_EQ((*tags)[1].family, TagFamily::tagStandard41h12);
  test::errors_of(*tags, picture);
  EXPECT_EQ(detector().detect(picture.view())->size(), 1u) << "only the requested family";
}

/// 2 x 2 tags of tag36h11 with black frames of `frame` cells and, optionally, black squares of the gap's size where
/// four gaps meet, which touch the tags' corners. Kalibr prints frames of two cells and squares.
std::vector<std::uint8_t> kalibr_print(int frame, bool squares) {
  constexpr int kCell = 6, kEdge = 400;
  const int tag = (6 + 2 * frame) * kCell, gap = tag * 3 / 10, first = 60;
  std::vector<std::uint8_t> pixels(kEdge * kEdge, 220);
  const auto black = [&](int left, int top, int size) {
    for (int y = top; y < top + size; ++y)
      for (int x = left; x < left + size; ++x) pixels[static_cast<std::size_t>(y * kEdge + x)] = 20;
  };
  for (int id = 0; id < 4; ++id) {
    const TagBitmap bitmap = tag_bitmap(TagFamily::tag36h11, id).value();
    const int left = first + (id % 2) * (tag + gap), top = first + (id / 2) * (tag + gap);
    black(left, top, tag);
    for (int row = 0; row < 6; ++row)
      for (int column = 0; column < 6; ++column)
        if (!bitmap.is_dark(column + 2, row + 2))
          for (int y = 0; y < kCell; ++y)
            for (int x = 0; x < kCell; ++x)
              pixels[static_cast<std::size_t>((top + (row + frame) * kCell + y) * kEdge + left +
                                              (column + frame) * kCell + x)] = 220;
  }
  if (squares)
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column)
        black(first - gap + column * (tag + gap), first - gap + row * (tag + gap), gap);
  return pixels;
}

TEST(TagDetector, DoesNotDetectTagsPrintedByKalibr) {
  const auto found = [](int frame, bool squares) {
    const auto pixels = kalibr_print(frame, squares);
    return detector().detect({pixels, 400, 400, 400})->size();
  };
  EXPECT_EQ(found(1, false), 4u) << "as lightwell-calibrate prints them";
  EXPECT_EQ(found(2, false), 0u) << "a frame of two cells";
  EXPECT_EQ(found(2, true), 0u) << "a frame of two cells and squares, as Kalibr prints them";
}

TEST(TagDetector, AnOccludedCornerIsNotRefined) {
  BoardPicture picture = camera().take(kOrigin, board_ahead(0));
  const auto before = detector().detect(picture.view());
  ASSERT_EQ(before->size(), 4u);
  TagOutline outline;
  outline.corners = (*before)[0].corners;
  const PixelPosition hidden = outline.corners[2];
  for (int y = 0; y < 400; ++y)
    for (int x = 0; x < 400; ++x)
      if (std::hypot(x - hidden.x, y - hidden.y) < 28) picture.pixels[static_cast<std::size_t>(y * 400 + x)] = 128;
  const auto corners = refine_corners(picture.view(), outline, {}).corners;
  EXPECT_FALSE(corners[2]);
  ASSERT_TRUE(corners[0]);
  EXPECT_NEAR(corners[0]->position.x, outline.corners[0].x, 0.3);
}

/// A shadow that ends within a tag joins its dark side to the ink.
TEST(TagDetector, ATagUnderTheEdgeOfAShadowIsFoundByTheLogarithm) {
  const std::vector<PlacedBoard> board = {test::board_facing(test::single_tag(3, 0.25), {0, 0, -0.6}, {0, 0, 1}, 0.3)};
  BoardPicture picture = camera().take(kOrigin, board);
  const auto lit = detector().detect(picture.view());
  ASSERT_EQ(lit->size(), 1u);
  const auto& corners = (*lit)[0].corners;
  for (int y = 0; y < 400; ++y)
    for (int x = 0; x < 400; ++x)
      if (x < (corners[0].x + corners[2].x) / 2) {
        auto& pixel = picture.pixels[static_cast<std::size_t>(y * 400 + x)];
        pixel = static_cast<std::uint8_t>(0.3 * pixel);
      }
  const DetectionWindow window{.region = {0, 0, 400, 400}};
  EXPECT_TRUE(detector().detect_in(picture.view(), window)->empty()) << "the logarithm would not be needed";
  DetectionWindow logarithmic = window;
  logarithmic.tones = Tones::logarithmic;
  const auto found = detector().detect_in(picture.view(), logarithmic);
  ASSERT_EQ(found->size(), 1u);
  EXPECT_EQ((*found)[0].id, 3);
  // Two and a half standard deviations of AprilTag's corners: beside the shadow's edge they cannot be refined.
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_LT(std::hypot((*found)[0].corners[k].x - corners[k].x, (*found)[0].corners[k].y - corners[k].y), 0.75) << k;
}

TEST(TagDetector, AnEnlargedPictureShowsTheSameCorners) {
  const BoardPicture picture = camera().take(kOrigin, board_ahead(0.4));
  const DetectionWindow window{.region = {21, 13, 370, 381}};
  DetectionWindow larger = window;
  larger.decimate = kEnlarged;
  TagDetectorOptions unrefined;
  unrefined.corners = CornerRefinement::none;
  const auto plain = detector(unrefined).detect_in(picture.view(), window);
  const auto enlarged = detector(unrefined).detect_in(picture.view(), larger);
  ASSERT_EQ(plain->size(), 4u);
  ASSERT_EQ(enlarged->size(), 4u);
  double offset_x = 0, offset_y = 0;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t k = 0; k < 4; ++k) {
      offset_x += ((*enlarged)[i].corners[k].x - (*plain)[i].corners[k].x) / 16;
      offset_y += ((*enlarged)[i].corners[k].y - (*plain)[i].corners[k].y) / 16;
    }
  // An error of half a pixel of the enlarged picture would be 0.25.
  EXPECT_NEAR(offset_x, 0, 0.1);
  EXPECT_NEAR(offset_y, 0, 0.1);
}

TEST(TagDetector, FindsNothingInPicturesWithoutTags) {
  std::mt19937_64 random(4);
  std::vector<std::uint8_t> noise(400 * 400);
  for (auto& v : noise) v = static_cast<std::uint8_t>(random());
  for (const auto& pixels :
       {std::vector<std::uint8_t>(400 * 400, 0), std::vector<std::uint8_t>(400 * 400, 255), noise}) {
    const auto tags = detector().detect({pixels, 400, 400, 400}, &camera().model());
    ASSERT_TRUE(tags);
    EXPECT_TRUE(tags->empty());
  }
  for (const int edge : {1, 2, 3, 5, 9, 31}) {
    const auto tags = detector().detect({noise, edge, edge, static_cast<std::size_t>(edge)}, &camera().model());
    ASSERT_TRUE(tags) << edge;
    EXPECT_TRUE(tags->empty()) << edge;
  }
}

TEST(TagDetector, RejectsInvalidPictures) {
  const std::vector<std::uint8_t> pixels(100 * 100);
  auto d = detector();
  EXPECT_THAT(d.detect({pixels, 100, 101, 100}).status().message(), HasSubstr("has 10000 bytes and needs 10100"));
  EXPECT_THAT(d.detect({pixels, 100, 50, 99}).status().message(), HasSubstr("stride is 99"));
  EXPECT_THAT(d.detect({pixels, 0, 50, 100}).status().message(), HasSubstr("0x50"));
  EXPECT_FALSE(d.detect({pixels, -5, 50, 100}));
  EXPECT_FALSE(d.detect({pixels, 20'000, 1, 20'000}));
  EXPECT_FALSE(d.detect({{}, 10, 10, 10}));
}

TEST(TagDetector, RejectsInvalidOptions) {
  const auto refused = [](auto change) {
    TagDetectorOptions options;
    change(options);
    const auto made = TagDetector::make(options);
    return made.ok() ? std::string("accepted") : made.status().message();
  };
  EXPECT_THAT(refused([](auto& o) { o.families.clear(); }), HasSubstr("families"));
  EXPECT_THAT(refused([](auto& o) { o.families.push_back(TagFamily::tag36h11); }), HasSubstr("twice"));
  EXPECT_THAT(refused([](auto& o) { o.linear.resize(255); }), HasSubstr("linear"));
  EXPECT_THAT(refused([&](auto& o) { o.linear.assign(256, std::numeric_limits<float>::infinity()); }),
              HasSubstr("finite"));
}

TEST(RectifiedViews, AreLimitedToThePictureNotToTheModel) {
  LensParameters webcam;
  webcam.width = 640;
  webcam.height = 480;
  webcam.model = KannalaBrandtParameters{620, 620, 319.5, 239.5, 0, 0, 0, 0};
  webcam.max_angle_rad = 3;
  // The corners of the picture are 37 degrees from the axis.
  EXPECT_TRUE(views_of(CameraModel(webcam), 640, 480, 0.7).empty());
  EXPECT_FALSE(views_of(CameraModel(webcam), 1280, 960, 0.7).empty());
}

}  // namespace
}  // namespace lightwell
