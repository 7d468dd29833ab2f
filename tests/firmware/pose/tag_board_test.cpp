// TagBoard: positions of its tags, Kalibr's YAML, validation; TagBitmap.
#include "pose/tag_board.hpp"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/temp_dir.hpp"

namespace lightwell {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

constexpr double kExact = 1e-15;

TagBoard small_board() {
  TagBoard board;
  board.columns = 3;
  board.rows = 2;
  board.tag_size_m = 0.1;
  board.spacing = 0.5;
  board.first_id = 10;
  return board;
}

void expect_at(Vec3d got, Vec3d wanted) {
  EXPECT_LT(length(got - wanted), kExact) << got.x << " " << got.y << " " << got.z;
}

TEST(TagBoard, TheFirstTagIsAtTheBottomLeftWithItsCornerInTheOrigin) {
  const auto c = small_board().corners(10);
  expect_at(c[0], {0, 0, 0});
  expect_at(c[1], {0.1, 0, 0});
  expect_at(c[2], {0.1, 0.1, 0});
  expect_at(c[3], {0, 0.1, 0});
}

TEST(TagBoard, IdsIncreaseToTheRightAndThenUpwards) {
  const TagBoard board = small_board();
  expect_at(board.corners(11)[0], {0.15, 0, 0});
  expect_at(board.corners(12)[0], {0.30, 0, 0});
  expect_at(board.corners(13)[0], {0, 0.15, 0});
  expect_at(board.center(15), {0.35, 0.20, 0});
  EXPECT_NEAR(board.width_m(), 0.4, kExact);
  EXPECT_NEAR(board.height_m(), 0.25, kExact);
}

TEST(TagBoard, ItsNormalIsPlusZ) {
  const auto c = small_board().corners(14);
  const Vec3d normal = cross(c[1] - c[0], c[3] - c[0]);
  EXPECT_GT(normal.z, 0) << "the corners run counterclockwise, seen from the printed face";
  EXPECT_EQ(normal.x, 0);
  EXPECT_EQ(normal.y, 0);
}

TEST(TagBoard, HoldsItsOwnIdsOnly) {
  const TagBoard board = small_board();
  EXPECT_FALSE(board.holds(TagFamily::tag36h11, 9));
  EXPECT_TRUE(board.holds(TagFamily::tag36h11, 10));
  EXPECT_TRUE(board.holds(TagFamily::tag36h11, 15));
  EXPECT_FALSE(board.holds(TagFamily::tag36h11, 16));
  EXPECT_FALSE(board.holds(TagFamily::tagStandard41h12, 12));
}

TEST(TagBoard, ReadsKalibrsTarget) {
  // The example of Kalibr's documentation.
  const auto board = parse_tag_board(
      "target_type: 'aprilgrid' #gridtype\n"
      "tagCols: 6               #number of apriltags\n"
      "tagRows: 7               #number of apriltags\n"
      "tagSize: 0.088           #size of apriltag, edge to edge [m]\n"
      "tagSpacing: 0.3          #ratio of space between tags to tagSize\n"
      "                         #example: tagSize=2m, spacing=0.5m --> tagSpacing=0.25[-]\n",
      "april.yaml");
  ASSERT_TRUE(board) << board.status().message();
  EXPECT_EQ(board->columns, 6);
  EXPECT_EQ(board->rows, 7);
  EXPECT_EQ(board->tag_size_m, 0.088);
  EXPECT_EQ(board->spacing, 0.3);
  EXPECT_EQ(board->first_id, 0);
  EXPECT_EQ(board->family, TagFamily::tag36h11);
  EXPECT_NEAR(board->corners(7)[0].x, 0.088 * 1.3, kExact) << "Kalibr's pitch";
}

TEST(TagBoard, TextRoundTripIsExact) {
  TagBoard board = small_board();
  board.family = TagFamily::tagStandard41h12;
  board.tag_size_m = 0.1 / 3;
  board.spacing = 2.0 / 3 + 0.2;
  const auto back = parse_tag_board(tag_board_to_text(board), "board");
  ASSERT_TRUE(back) << back.status().message();
  EXPECT_EQ(back->family, board.family);
  EXPECT_EQ(back->columns, board.columns);
  EXPECT_EQ(back->rows, board.rows);
  EXPECT_EQ(back->tag_size_m, board.tag_size_m);
  EXPECT_EQ(back->spacing, board.spacing);
  EXPECT_EQ(back->first_id, board.first_id);
}

TEST(TagBoard, LoadsFromAFile) {
  const test::TempDir folder;
  const auto board = load_tag_board(folder.write("b.yaml", tag_board_to_text(small_board())));
  ASSERT_TRUE(board) << board.status().message();
  EXPECT_EQ(board->first_id, 10);
  EXPECT_EQ(load_tag_board(folder.path("none.yaml")).status().code(), StatusCode::not_found);
}

std::string refusal(std::string_view text) {
  const auto board = parse_tag_board(text, "b.yaml");
  EXPECT_FALSE(board) << text;
  return board.status().message();
}

constexpr const char* kGood = "target_type: aprilgrid\ntagCols: 6\ntagRows: 6\ntagSize: 0.02\n";

TEST(TagBoard, ParseErrorsNameTheLineAndTheRemedy) {
  const std::string good = kGood;
  EXPECT_EQ(refusal(good + "tagSpacin: 0.3\n"), "b.yaml:5: unknown field 'tagSpacin'; did you mean 'tagSpacing'?");
  EXPECT_THAT(refusal(good), HasSubstr("tagSpacing is missing"));
  EXPECT_THAT(refusal(good + "tagSpacing: 0.3\ntagCols: 7\n"),
              StartsWith("b.yaml:6: tagCols is given twice; the first is on line 2"));
  EXPECT_THAT(refusal(good + "tagSpacing: wide\n"), StartsWith("b.yaml:5: tagSpacing: 'wide' is not a number"));
  EXPECT_THAT(refusal(good + "tagSpacing: 0.3\ncodeOffset: 1.5\n"), HasSubstr("'1.5' is not a whole number"));
  EXPECT_THAT(refusal(good + "tagSpacing: 0.3\ntagFamily: tag16h5\n"), HasSubstr("known are tag36h11"));
  EXPECT_THAT(refusal("target_type: 'checkerboard'\n"), HasSubstr("'aprilgrid'"));
  EXPECT_THAT(refusal(good + "tagSpacing 0.3\n"), HasSubstr("is not 'name: value'"));
  EXPECT_THAT(refusal(""), HasSubstr("target_type is missing"));
}

TEST(TagBoard, RejectsBoardsThatCannotBePrinted) {
  const auto refused = [](auto change) {
    TagBoard board = small_board();
    change(board);
    return board.validate().message();
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(small_board().validate().ok());
  EXPECT_THAT(refused([](TagBoard& b) { b.columns = 0; }), HasSubstr("tagCols"));
  EXPECT_THAT(refused([](TagBoard& b) { b.rows = 101; }), HasSubstr("tagRows"));
  for (const double size : {0.0, -0.1, kNan, kInf, 11.0})
    EXPECT_THAT(refused([&](TagBoard& b) { b.tag_size_m = size; }), HasSubstr("tagSize")) << size;
  for (const double spacing : {0.0, 0.1, -1.0, kNan, kInf})
    EXPECT_THAT(refused([&](TagBoard& b) { b.spacing = spacing; }), HasSubstr("tagSpacing")) << spacing;
  EXPECT_THAT(refused([](TagBoard& b) { b.first_id = 582; }), HasSubstr("numbers 0 to 586"));
  EXPECT_THAT(refused([](TagBoard& b) { b.first_id = std::numeric_limits<int>::max(); }), HasSubstr("codeOffset"));
  EXPECT_THAT(refused([](TagBoard& b) { b.family = TagFamily::tagStandard41h12; }), HasSubstr("at least 0.8"))
      << "its data bits lie outside the square, two cells on each side";
}

TEST(TagBitmap, Tag36h11HasABlackFrameInAWhiteRim) {
  const TagBitmap tag = tag_bitmap(TagFamily::tag36h11, 0).value();
  ASSERT_EQ(tag.cells, shape_of(TagFamily::tag36h11).cells);
  for (int i = 0; i < 10; ++i) {
    EXPECT_FALSE(tag.is_dark(i, 0) || tag.is_dark(i, 9) || tag.is_dark(0, i) || tag.is_dark(9, i));
    if (i > 0 && i < 9) {
      EXPECT_TRUE(tag.is_dark(i, 1) && tag.is_dark(i, 8) && tag.is_dark(1, i) && tag.is_dark(8, i));
    }
  }
}

TEST(TagBitmap, TagStandard41h12HasAWhiteSquareInABlackRing) {
  const TagBitmap tag = tag_bitmap(TagFamily::tagStandard41h12, 3).value();
  ASSERT_EQ(tag.cells, shape_of(TagFamily::tagStandard41h12).cells);
  for (int i = 1; i < 8; ++i) {
    EXPECT_TRUE(tag.is_dark(i, 1) && tag.is_dark(i, 7) && tag.is_dark(1, i) && tag.is_dark(7, i));
    if (i > 1 && i < 7) {
      EXPECT_FALSE(tag.is_dark(i, 2) || tag.is_dark(i, 6) || tag.is_dark(2, i) || tag.is_dark(6, i));
    }
  }
}

TEST(TagBitmap, RejectsIdsThatTheFamilyDoesNotHave) {
  EXPECT_TRUE(tag_bitmap(TagFamily::tag36h11, 586));
  EXPECT_THAT(tag_bitmap(TagFamily::tag36h11, 587).status().message(), HasSubstr("its last is 586"));
  EXPECT_TRUE(tag_bitmap(TagFamily::tagStandard41h12, 2114));
  EXPECT_FALSE(tag_bitmap(TagFamily::tagStandard41h12, 2115));
  EXPECT_FALSE(tag_bitmap(TagFamily::tag36h11, -1));
}

}  // namespace
}  // namespace lightwell
