// lightwell-calibrate board: position and scale of the printed tags in each file format, and errors.
#include <cmath>
#include <iostream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/tools/calibrate_words.hpp"
#include "firmware/tools/printed_tags.hpp"
#include "imaging/image_file.hpp"
#include "support/child.hpp"
#include "support/read_file.hpp"
#include "support/temp_dir.hpp"
#include "tools/lightwell_calibrate/commands.hpp"
#include "tools/lightwell_calibrate/sheets.hpp"

namespace lightwell::calibrate {
namespace {

using test::CommandResult;
using test::run;
using test::TempDir;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

/// Expects all tags of `board` in the picture of the whole sheet at `dpi`. Returns the largest error of a corner, mm,
/// relative to the sheet's origin and the board's geometry.
double expect_printed(const std::string& png, const TagBoard& board, const BoardPage& sheet, double dpi) {
  const Result<Image> image = read_image(png);
  EXPECT_TRUE(image) << image.status().message();
  if (!image) return 1e9;
  EXPECT_NEAR(image->width, sheet.page.width * dpi / 25.4, 1) << "the sheet's size";
  EXPECT_NEAR(image->height, sheet.page.height * dpi / 25.4, 1);
  const auto tags = test::printed_tags(png, board.family, dpi);
  EXPECT_EQ(tags.size(), static_cast<std::size_t>(board.tags()));
  double worst = 0;
  for (const auto& [id, printed] : tags) {
    EXPECT_TRUE(board.holds(board.family, id)) << id;
    if (!board.holds(board.family, id)) continue;
    const auto corners = board.corners(id);
    for (std::size_t k = 0; k < 4; ++k)
      worst = std::max(worst, std::hypot(printed[k].x - (sheet.origin_x_mm + 1000 * corners[k].x),
                                         printed[k].y - (sheet.origin_y_mm - 1000 * corners[k].y)));
  }
  std::cout << tags.size() << " tags at " << dpi << " dpi: the worst corner is off by " << worst << " mm\n";
  return worst;
}

/// Renders a PDF with poppler; returns the path of the PNG.
std::string rendered(const TempDir& folder, const std::string& pdf, int dpi) {
  test::Child child({LIGHTWELL_PDFTOPPM, "-png", "-singlefile", "-r", std::to_string(dpi), pdf, folder.path("sheet")});
  EXPECT_EQ(child.wait(), test::ExitStatus{0}) << child.err();
  EXPECT_THAT(child.err(), IsEmpty()) << "poppler must not report errors in the PDF";
  return folder.path("sheet.png");
}

TEST(BoardCommand, ThePdfHasEveryTagAtItsPosition) {
  const TempDir folder;
  const std::string pdf = folder.path("board.pdf");
  const CommandResult result = run(board_command, {"--output", pdf});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(test::read_file(pdf), StartsWith("%PDF-1."));
  const TagBoard board;
  const auto sheet = layout(board, kPapers[0]);
  ASSERT_TRUE(sheet);
  // A pixel is 0.17 mm; poppler may round the edges of rectangles to whole pixels.
  EXPECT_LT(expect_printed(rendered(folder, pdf, 150), board, *sheet, 150), 0.1);
}

TEST(BoardCommand, AcceptsOtherFamiliesSheetsAndIds) {
  const TempDir folder;
  const std::string pdf = folder.path("board.pdf");
  const CommandResult result =
      run(board_command, {"--family", "tagStandard41h12", "--columns=7", "--rows", "3", "--tag-size-mm", "18",
                          "--first-id", "40", "--paper", "letter", "--output", pdf});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("landscape letter"));
  TagBoard board{TagFamily::tagStandard41h12, 7, 3, 0.018, 1, 40};
  const auto sheet = layout(board, kPapers[2]);
  ASSERT_TRUE(sheet) << sheet.status().message();
  EXPECT_LT(expect_printed(rendered(folder, pdf, 150), board, *sheet, 150), 0.1);
}

TEST(BoardCommand, ThePngIsTrueToScale) {
  const TempDir folder;
  const std::string png = folder.path("board.png");
  ASSERT_EQ(run(board_command, {"--dpi", "100", "--output", png}).status, 0);
  const TagBoard board;
  // The coverage of pixels is exact, so the accuracy is that of the detector.
  EXPECT_LT(expect_printed(png, board, *layout(board, kPapers[0]), 100), 0.02);
}

TEST(BoardCommand, TheSvgIsInMillimetresAndHasEachRectangleOfThePage) {
  const TempDir folder;
  const std::string path = folder.path("board.svg");
  ASSERT_EQ(run(board_command, {"--paper", "a3", "--output", path}).status, 0);
  const std::string svg = test::read_file(path);
  EXPECT_THAT(svg, HasSubstr("width=\"297mm\" height=\"420mm\" viewBox=\"0 0 297 420\""));
  const auto sheet = layout(TagBoard{}, kPapers[1]);
  std::size_t rectangles = 0;
  for (const PageArea& area : sheet->page.areas) rectangles += area.outlines.size();
  EXPECT_EQ(test::occurrences(svg, "M"), rectangles);
  EXPECT_EQ(test::occurrences(svg, "<path"), sheet->page.areas.size());
}

TEST(BoardCommand, TheSheetHasADescriptionAndARulerOfTenCentimetres) {
  const auto sheet = layout(TagBoard{}, kPapers[0]);
  ASSERT_TRUE(sheet);
  const Page& page = sheet->page;
  EXPECT_THAT(page.texts[0].text, HasSubstr("tag36h11, 6 x 6 tags, numbers 0 to 35"));
  EXPECT_THAT(page.texts[0].text, HasSubstr("tag 24 mm, gap 7.2 mm (spacing 0.3)"));
  EXPECT_THAT(page.texts[1].text, HasSubstr("180 x 180 mm"));
  double left = 1e9, right = 0;
  for (const auto& stroke : page.areas.back().outlines)
    for (const PagePoint& p : stroke) left = std::min(left, p.x), right = std::max(right, p.x);
  EXPECT_NEAR(right - left, 100, 1e-9) << "from the outside of the first stroke to that of the last";
  for (const PageText& t : page.texts) EXPECT_LT(t.y, page.height - 3) << t.text;
}

TEST(BoardCommand, TheYamlDescribesTheBoard) {
  const TempDir folder;
  ASSERT_EQ(
      run(board_command, {"--columns", "4", "--rows", "5", "--tag-size-mm", "30", "--output", folder.path("b.yaml")})
          .status,
      0);
  const auto board = load_tag_board(folder.path("b.yaml"));
  ASSERT_TRUE(board) << board.status().message();
  EXPECT_EQ(board->columns, 4);
  EXPECT_EQ(board->rows, 5);
  EXPECT_EQ(board->tag_size_m, 0.03);
}

TEST(BoardCommand, JsonHasTheLayout) {
  const CommandResult result = run(board_command, {"--json"});
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.out, HasSubstr("\"sheet_mm\":[210.0,297.0],\"origin_mm\":["));
  EXPECT_THAT(result.out, HasSubstr("\"tag_size_m\":0.024"));
}

TEST(BoardCommand, ErrorsHaveTheRemedy) {
  const auto usage = [](std::vector<std::string> words) {
    const CommandResult result = run(board_command, std::move(words));
    EXPECT_EQ(result.status, 2) << result.err;
    EXPECT_THAT(result.err, StartsWith("lightwell-calibrate board: "));
    return result.err;
  };
  EXPECT_THAT(usage({}), HasSubstr("give --output"));
  EXPECT_THAT(usage({"--colums", "3"}), HasSubstr("did you mean --columns?"));
  EXPECT_THAT(usage({"--columns"}), HasSubstr("--columns: 1 required INT missing"));
  EXPECT_THAT(usage({"--columns", "x"}), HasSubstr("--columns = x"));
  EXPECT_THAT(usage({"--columns", "0", "--json"}), HasSubstr("columns"));
  EXPECT_THAT(usage({"--tag-size-mm", "nan", "--json"}), HasSubstr("is nan; it is in metres"));
  EXPECT_THAT(usage({"--spacing", "0.01", "--json"}), HasSubstr("spacing"));
  EXPECT_THAT(usage({"--paper", "a5"}), HasSubstr("known are: a4 a3 letter"));
  EXPECT_THAT(usage({"--family", "tag16h5"}), HasSubstr("known are tag36h11"));
  EXPECT_THAT(usage({"--output", "board.doc"}), HasSubstr("must end in .pdf"));
  EXPECT_THAT(usage({"board.pdf"}), HasSubstr("unexpected argument 'board.pdf'"));
  EXPECT_THAT(usage({"--dpi", "0"}), HasSubstr("36 to 2400"));

  const CommandResult large = run(board_command, {"--tag-size-mm", "40", "--json"});
  EXPECT_EQ(large.status, 1);
  EXPECT_THAT(large.err, HasSubstr("does not fit a4; --tag-size-mm 25.2 would"));
  EXPECT_EQ(run(board_command, {"--tag-size-mm", "25.2", "--json"}).status, 0) << "the size in the message must fit";

  const CommandResult nowhere = run(board_command, {"--output", "/nonexistent/board.pdf"});
  EXPECT_EQ(nowhere.status, 1);
  EXPECT_THAT(nowhere.err, HasSubstr("/nonexistent/board.pdf: cannot be written"));
  const CommandResult help = run(board_command, {"--help"});
  EXPECT_EQ(help.status, 0);
  EXPECT_THAT(help.out, HasSubstr("Exit status: 0 done, 1"));
}

}  // namespace
}  // namespace lightwell::calibrate
