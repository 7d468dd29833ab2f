// The PDF of a marker sheet, rendered by poppler: pages, scale and tags.
#include <iostream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/tools/calibrate_words.hpp"
#include "firmware/tools/marker_sheets.hpp"
#include "support/child.hpp"
#include "support/temp_dir.hpp"
#include "tools/lightwell_calibrate/commands.hpp"

namespace lightwell::calibrate {
namespace {

TEST(MarkerSheetPdf, EachPageHasItsTagsAtTheirPositions) {
  const test::TempDir folder;
  const std::string pdf = folder.path("sheet.pdf");
  const test::CommandResult result = test::run(marker_sheet_command, {"--paper-kind", "grey", "--output", pdf});
  ASSERT_EQ(result.status, 0) << result.err;
  test::Child child({LIGHTWELL_PDFTOPPM, "-png", "-r", "150", pdf, folder.path("page")});
  EXPECT_EQ(child.wait(), test::ExitStatus{0}) << child.err();
  EXPECT_THAT(child.err(), testing::IsEmpty()) << "poppler must not report errors in the PDF";
  const MarkerBody body = test::marker_body("dodecahedron", 0.1);
  const auto net = make_net(body, kPapers[0]);
  ASSERT_EQ(net->pages.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    const double worst =
        test::worst_printed(folder.path("page-" + std::to_string(i + 1) + ".png"), body, net->pages[i], 150);
    std::cout << "page " << i + 1 << ": the worst corner is off by " << worst << " mm\n";
    // A pixel is 0.17 mm; poppler may round axis-parallel edges to whole pixels.
    EXPECT_LT(worst, 0.1);
  }
  EXPECT_FALSE(std::filesystem::exists(folder.path("page-3.png")));
}

}  // namespace
}  // namespace lightwell::calibrate
