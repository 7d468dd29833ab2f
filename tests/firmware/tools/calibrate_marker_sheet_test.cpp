// lightwell-calibrate marker-sheet: scale, greys, text, body file and errors.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/tools/calibrate_words.hpp"
#include "firmware/tools/marker_sheets.hpp"
#include "support/child.hpp"
#include "support/read_file.hpp"
#include "support/temp_dir.hpp"
#include "tools/lightwell_calibrate/commands.hpp"
#include "tools/lightwell_calibrate/marker_net.hpp"

namespace lightwell::calibrate {
namespace {

using test::CommandResult;
using test::marker_body;
using test::run;
using test::TempDir;
using testing::HasSubstr;
using testing::StartsWith;

struct Printed {
  std::string solid;
  double size_mm;
  std::string kind, family, paper;
  int first_id;
};

void PrintTo(const Printed& p, std::ostream* out) {
  *out << p.solid << " " << p.size_mm << " mm " << p.kind << " " << p.family;
}

class PrintedMarker : public testing::TestWithParam<Printed> {};

INSTANTIATE_TEST_SUITE_P(Sheets, PrintedMarker,
                         testing::Values(Printed{"dodecahedron", 100, "grey", "tag36h11", "a4", 0},
                                         Printed{"dodecahedron", 100, "white", "tag36h11", "letter", 30},
                                         Printed{"dodecahedron", 100, "grey", "tagStandard41h12", "a4", 100},
                                         Printed{"dodecahedron", 170, "grey", "tag36h11", "a4", 0},
                                         Printed{"cube", 60, "grey", "tag36h11", "a4", 6},
                                         Printed{"icosahedron", 100, "grey", "tag36h11", "a4", 0}));

TEST_P(PrintedMarker, HasEveryTagAtItsPositionTrueToScale) {
  const Printed& p = GetParam();
  const TempDir folder;
  const CommandResult result =
      run(marker_sheet_command, {"--body", p.solid, "--size-mm", std::to_string(p.size_mm), "--paper-kind", p.kind,
                                 "--family", p.family, "--paper", p.paper, "--first-id", std::to_string(p.first_id),
                                 "--dpi", "150", "--output", folder.path("sheet.png")});
  ASSERT_EQ(result.status, 0) << result.err;
  const TagFamily family = *parse_tag_family(p.family);
  const MarkerBody body = marker_body(p.solid, p.size_mm / 1000, *parse_paper_kind(p.kind), family, p.first_id);
  const auto net = make_net(body, *std::ranges::find(kPapers, p.paper, &Paper::name));
  ASSERT_TRUE(net.ok());
  for (std::size_t i = 0; i < net->pages.size(); ++i) {
    const std::string name = net->pages.size() == 1 ? "sheet.png" : "sheet-" + std::to_string(i + 1) + ".png";
    const double worst = test::worst_printed(folder.path(name), body, net->pages[i], 150);
    std::cout << name << ": the worst corner is off by " << worst << " mm\n";
    EXPECT_LT(worst, 0.05);
  }
}

TEST(MarkerSheet, QuadrantsArePrintedAsGreysOfThePaper) {
  const TempDir folder;
  ASSERT_EQ(
      run(marker_sheet_command, {"--paper-kind", "grey", "--dpi", "100", "--output", folder.path("s.png")}).status, 0);
  const MarkerBody body = marker_body("dodecahedron", 0.1);
  const auto net = make_net(body, kPapers[0]);
  for (std::size_t page = 0; page < 2; ++page) {
    const Result<Image> image = read_image(folder.path("s-" + std::to_string(page + 1) + ".png"));
    ASSERT_TRUE(image);
    for (const NetFace& placed : net->pages[page].faces)
      for (const MarkerPatch& patch : body.faces[placed.face].patches) {
        FacePoint middle;
        for (const FacePoint& p : patch.outline)
          middle.x += p.x / static_cast<double>(patch.outline.size()),
              middle.y += p.y / static_cast<double>(patch.outline.size());
        const PagePoint at = placed.on_sheet(middle);
        const int x = static_cast<int>(at.x * 100 / 25.4), y = static_cast<int>(at.y * 100 / 25.4);
        const int value = std::to_integer<int>(image->data[static_cast<std::size_t>(3 * (y * image->width + x))]);
        // sRGB of 1, 3/4, 1/2 and 1/4 (IEC 61966-2-1).
        const int wanted = patch.albedo[0] == 0.8   ? 255
                           : patch.albedo[0] == 0.6 ? 225
                           : patch.albedo[0] == 0.4 ? 188
                                                    : 137;
        EXPECT_EQ(value, wanted) << "face " << placed.face;
      }
  }
}

TEST(MarkerSheet, AdjacentGreysHaveNoGap) {
  const MarkerBody body = marker_body("cube", 0.06);
  const TempDir folder;
  const auto net = make_net(body, kPapers[0]);
  const auto pages = draw_net(body, *net);
  ASSERT_TRUE(pages.ok());
  int checked = 0;
  for (const double dpi : {61.0, 77.0, 100.0}) {
    ASSERT_TRUE(write_page_png(pages->at(0), dpi, folder.path("p.png")).ok());
    const Result<Image> image = read_image(folder.path("p.png"));
    for (const NetFace& placed : net->pages[0].faces) {
      if (std::abs(std::sin(placed.turn_rad)) > 1e-9 || std::cos(placed.turn_rad) < 0) continue;
      // A pixel on the line between the quadrants below the tag: albedo 0.40 on its left, 0.20 on its right.
      const PagePoint at = placed.on_sheet({0, -0.022});
      const double line = at.x * dpi / 25.4, left = line - std::floor(line);
      const int column = static_cast<int>(line), row = static_cast<int>(at.y * dpi / 25.4);
      const int value = std::to_integer<int>(image->data[static_cast<std::size_t>(3 * (row * image->width + column))]);
      EXPECT_NEAR(value, 188 * left + 137 * (1 - left), 1.5) << "a mixture of only the two greys, share " << left;
      ++checked;
    }
  }
  EXPECT_GE(checked, 9);
}

TEST(MarkerSheet, HasADescriptionAndARuler) {
  for (const PaperKind kind : {PaperKind::white, PaperKind::grey}) {
    const MarkerBody body = marker_body("dodecahedron", 0.1, kind);
    const auto net = make_net(body, kPapers[0]);
    const auto pages = draw_net(body, *net);
    ASSERT_TRUE(pages.ok());
    for (const Page& page : *pages) {
      std::string words;
      for (const PageText& t : page.texts) {
        words += t.text + "\n";
        EXPECT_LT(t.y, page.height - kPrinterMargin_mm) << t.text;
        // Upper limit of the text width: Helvetica's letters are 0.5 em wide on average, those of the PNG font wider.
        EXPECT_LT(t.x + 0.66 * t.size * static_cast<double>(t.text.size()), page.width) << t.text;
      }
      EXPECT_THAT(words, HasSubstr("dodecahedron 100 mm " + std::string(to_string(kind)) + ", tag36h11 of 24 mm"));
      EXPECT_THAT(words,
                  HasSubstr(&page == &pages->front() ? "Page 1 of 2: tags 0, 1, 2, 3, 4, 5." : "Page 2 of 2: tags 11"));
      EXPECT_THAT(words, HasSubstr("Print at 100 %"));
      EXPECT_THAT(words, HasSubstr("glue each tab beneath the face whose number it bears"));
      const std::string about_greys = "Printers differ: the greys' albedos must be checked";
      EXPECT_EQ(words.find(about_greys) != std::string::npos, kind == PaperKind::grey);
      double left = 1e9, right = 0;
      for (const auto& stroke : page.areas.back().outlines)
        for (const PagePoint& p : stroke) left = std::min(left, p.x), right = std::max(right, p.x);
      EXPECT_NEAR(right - left, 100, 1e-9);
    }
  }
}

TEST(MarkerSheet, OfABallHasACrossAtItsPosition) {
  const auto body = make_ball_on_tag();
  const auto net = make_net(*body, kPapers[0]);
  ASSERT_TRUE(net.ok());
  const auto pages = draw_net(*body, *net);
  ASSERT_EQ(pages->size(), 1U);
  const PagePoint foot = net->pages[0].faces[0].on_sheet({0, 0.04});
  // The circle around the cross has the diameter of the ball.
  double left = 1e9, right = 0, top = 1e9, bottom = 0;
  for (const auto& outline : pages->front().areas.back().outlines)
    for (const PagePoint& p : outline) {
      left = std::min(left, p.x), right = std::max(right, p.x);
      top = std::min(top, p.y), bottom = std::max(bottom, p.y);
    }
  EXPECT_NEAR((left + right) / 2, foot.x, 0.01);
  EXPECT_NEAR((top + bottom) / 2, foot.y, 0.01);
  EXPECT_NEAR(right - left, 40, 0.2);
  EXPECT_THAT(pages->front().texts[3].text, HasSubstr("ball of 40 mm onto the cross"));
  EXPECT_EQ(net->pages[0].cuts.size(), 4U);
}

TEST(MarkerSheet, NumbersAreUnderlinedBarsOfTheRequestedSize) {
  for (const int number : {0, 7, 19, 586}) {
    double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9, lowest = 0;
    for (const Rectangle& r : digits(number, 2.4, 1.8)) {
      left = std::min(left, r.x), right = std::max(right, r.x + r.width);
      top = std::min(top, r.y), bottom = std::max(bottom, r.y + r.height);
      if (r.y + r.height == bottom) lowest = r.width;
    }
    EXPECT_LE(right - left, 2.4 + 1e-9) << number;
    EXPECT_LE(bottom - top, 1.8 + 1e-9) << number;
    EXPECT_NEAR(top + bottom, 0, 0.2) << "centred at the origin";
    EXPECT_NEAR(lowest, right - left, 1e-9) << "the underline is as wide as the number";
  }
  EXPECT_EQ(digits(8, 9, 9).size(), 8U);
  EXPECT_EQ(digits(1, 9, 9).size(), 3U);
}

TEST(MarkerSheet, WritesOneFilePerPageAndAllPagesToThePdf) {
  const TempDir folder;
  const CommandResult result =
      run(marker_sheet_command, {"--paper-kind=grey", "--output", folder.path("s.svg"), "--output",
                                 folder.path("s.pdf"), "--output", folder.path("body.textproto"), "--json"});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_FALSE(std::filesystem::exists(folder.path("s.svg")));
  for (const char* name : {"s-1.svg", "s-2.svg"}) {
    const std::string svg = test::read_file(folder.path(name));
    EXPECT_THAT(svg, HasSubstr("width=\"210mm\" height=\"297mm\" viewBox=\"0 0 210 297\""));
    for (const char* fill : {"#000000", "#e1e1e1", "#bcbcbc", "#898989"}) EXPECT_THAT(svg, HasSubstr(fill)) << name;
  }
  const std::string pdf = test::read_file(folder.path("s.pdf"));
  EXPECT_THAT(pdf, StartsWith("%PDF-1."));
  EXPECT_THAT(pdf, HasSubstr("/Count 2"));
  EXPECT_THAT(pdf, HasSubstr("/PrintScaling /None"));
  EXPECT_THAT(result.out, HasSubstr("\"name\":\"dodecahedron 100 mm grey\""));
  EXPECT_THAT(result.out, HasSubstr("s-2.svg"));
  EXPECT_THAT(result.out, HasSubstr("{\"tag_id\":0,\"center_mm\":["));
  EXPECT_THAT(result.out, HasSubstr("\"between\":[0,1]"));
  EXPECT_EQ(test::occurrences(result.out, "\"turn_deg\""), 12U);
  EXPECT_EQ(test::occurrences(result.out, "\"between\""), 10U);
  EXPECT_EQ(test::occurrences(result.out, "\"under\""), 20U);
  const auto body = load_marker_body(folder.path("body.textproto"));
  ASSERT_TRUE(body.ok()) << body.status().message();
  EXPECT_EQ(*body, marker_body("dodecahedron", 0.1));
}

TEST(MarkerSheet, AllBodiesCanBeSelected) {
  const TempDir folder;
  for (const std::string solid : {"dodecahedron", "cube", "icosahedron", "ball"}) {
    const std::string path = folder.path(solid + ".textproto");
    const CommandResult result = run(marker_sheet_command, {"--body", solid, "--output", path});
    ASSERT_EQ(result.status, 0) << result.err;
    const auto body = load_marker_body(path);
    ASSERT_TRUE(body.ok()) << body.status().message();
    EXPECT_THAT(body->name, StartsWith(solid));
    EXPECT_EQ(body->ball.has_value(), solid == "ball");
  }
}

TEST(MarkerSheet, TheMeasuredRulerScalesTheBody) {
  const TempDir folder;
  const std::string path = folder.path("b.textproto");
  ASSERT_EQ(run(marker_sheet_command, {"--ruler-mm", "98", "--output", path}).status, 0);
  const auto body = load_marker_body(path);
  ASSERT_TRUE(body.ok());
  EXPECT_EQ(body->name, "dodecahedron 98 mm white");
  EXPECT_NEAR(body->tag_size_m, 0.02352, 1e-12) << "the printed tag, scaled";
  EXPECT_NEAR(body->faces[0].body_face.translation.y, 0.049, 1e-12);

  ASSERT_EQ(run(marker_sheet_command, {"--body", "ball", "--ruler-mm", "105", "--output", path}).status, 0);
  const auto ball = load_marker_body(path);
  ASSERT_TRUE(ball.ok());
  EXPECT_EQ(ball->ball->radius_m, 0.02) << "the ball is not printed";
  EXPECT_NEAR(ball->tag_size_m, 0.024 * 1.05, 1e-12);
  EXPECT_NEAR(ball->faces[0].body_face.translation.z, 0.042, 1e-12) << "the distance of the cross scales";
  EXPECT_NEAR(ball->faces[0].body_face.translation.y, -0.02, 1e-12);
}

TEST(MarkerSheet, ErrorsHaveTheRemedy) {
  const auto usage = [](std::vector<std::string> words) {
    const CommandResult result = run(marker_sheet_command, std::move(words));
    EXPECT_EQ(result.status, 2) << result.err;
    EXPECT_THAT(result.err, StartsWith("lightwell-calibrate marker-sheet: "));
    return result.err;
  };
  EXPECT_THAT(usage({}), HasSubstr("give --output"));
  EXPECT_THAT(usage({"--bodi", "cube"}), HasSubstr("did you mean --body?"));
  EXPECT_THAT(usage({"--body", "tetrahedron"}), HasSubstr("known are: dodecahedron cube icosahedron ball"));
  EXPECT_THAT(usage({"--paper-kind", "black"}), HasSubstr("known are white and grey"));
  EXPECT_THAT(usage({"--paper", "a5"}), HasSubstr("known are: a4 a3 letter"));
  EXPECT_THAT(usage({"--family", "tag16h5"}), HasSubstr("known are tag36h11"));
  for (const char* size : {"0", "-3", "nan", "20000", "x"})
    EXPECT_THAT(usage({"--size-mm", size, "--json"}), HasSubstr(size));
  EXPECT_THAT(usage({"--tag-size-mm", "0", "--json"}), HasSubstr("'0'"));
  EXPECT_THAT(usage({"--dpi", "0"}), HasSubstr("36 to 2400"));
  EXPECT_THAT(usage({"--ruler-mm", "4"}), HasSubstr("50 to 200"));
  EXPECT_THAT(usage({"--ruler-mm", "98", "--output", "s.pdf"}), HasSubstr("goes with --output BODY.textproto alone"));
  EXPECT_THAT(usage({"--output", "s.doc"}), HasSubstr("must end in .pdf"));
  EXPECT_THAT(usage({"s.pdf"}), HasSubstr("unexpected argument 's.pdf'"));

  const auto input = [](std::vector<std::string> words) {
    const CommandResult result = run(marker_sheet_command, std::move(words));
    EXPECT_EQ(result.status, 1) << result.err;
    return result.err;
  };
  EXPECT_THAT(input({"--tag-size-mm", "60", "--json"}), HasSubstr("at most 0.0"));
  EXPECT_THAT(input({"--first-id", "580", "--json"}), HasSubstr("tag36h11 has numbers 0 to 586"));
  EXPECT_THAT(input({"--output", "/nonexistent/s.pdf"}), HasSubstr("/nonexistent/s.pdf: cannot be written"));
  const CommandResult help = run(marker_sheet_command, {"--help"});
  EXPECT_EQ(help.status, 0);
  for (const char* instruction :
       {"Score the dashed", "Measure the ruler", "matt white paper", "Glue each tab", "Exit status: 0 done, 1"})
    EXPECT_THAT(help.out, HasSubstr(instruction));
}

TEST(MarkerSheet, AnErrorGivesTheLargestSizeThatFits) {
  for (const std::string body : {"dodecahedron", "cube", "ball"}) {
    const CommandResult large = run(marker_sheet_command, {"--body", body, "--size-mm", "600", "--json"});
    EXPECT_EQ(large.status, 1);
    const std::string before = "does not fit a4; --size-mm ";
    ASSERT_THAT(large.err, HasSubstr(before));
    const double fits = std::stod(large.err.substr(large.err.find(before) + before.size()));
    EXPECT_GT(fits, 50);
    EXPECT_EQ(run(marker_sheet_command, {"--body", body, "--size-mm", std::to_string(fits), "--json"}).status, 0)
        << "the size in the message must fit";
    EXPECT_EQ(run(marker_sheet_command, {"--body", body, "--size-mm", std::to_string(fits * 1.01), "--json"}).status, 1)
        << "a size 1 % larger must not fit";
  }
  const TempDir folder;
  EXPECT_EQ(run(marker_sheet_command, {"--size-mm", "600", "--output", folder.path("b.textproto")}).status, 0)
      << "a body file alone need not fit a paper";
}

}  // namespace
}  // namespace lightwell::calibrate
