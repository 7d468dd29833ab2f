#include <array>
#include <iostream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tools/command_line.hpp"
#include "tools/lightwell_calibrate/commands.hpp"
#include "tools/lightwell_calibrate/sheets.hpp"

namespace lightwell::calibrate {

namespace {

constexpr const char* kFooter = R"(Examples:
  lightwell-calibrate board --output board.pdf
  lightwell-calibrate board --columns 6 --rows 8 --tag-size-mm 22 --spacing 0.3 --paper a4 --output board.pdf
  lightwell-calibrate board --columns 1 --rows 1 --tag-size-mm 160 --first-id 7 --output tag7.pdf
  lightwell-calibrate board --output board.pdf --output board.yaml --json

The sheet has a description and a ruler. Print at 100 %, measure the ruler, and multiply the tag size in the board's
YAML by measured / 100 mm. Glue the board onto something flat: bent paper makes a calibration inaccurate.
Exit status: 0 done, 1 an input is wrong (standard error has the reason and the remedy), 2 wrong usage.)";

nlohmann::ordered_json json_of(const TagBoard& board, const SheetOptions& options, const BoardPage& sheet) {
  return {{"family", to_string(board.family)},
          {"columns", board.columns},
          {"rows", board.rows},
          {"tag_size_m", json_number(board.tag_size_m)},
          {"spacing", json_number(board.spacing)},
          {"first_id", board.first_id},
          {"paper", options.paper.name},
          {"sheet_mm", json_numbers(std::array{sheet.page.width, sheet.page.height})},
          {"origin_mm", json_numbers(std::array{sheet.origin_x_mm, sheet.origin_y_mm})},
          {"files", options.outputs}};
}

}  // namespace

int board_command(const std::vector<std::string>& arguments) {
  CLI::App app{"A board of AprilTags to print, true to scale.", "lightwell-calibrate board"};
  app.footer(kFooter);
  TagBoard board;
  SheetOptions in;
  double tag_size_mm = 24;
  add_parsed_option(app, "--family", board.family, parse_tag_family, "tag36h11 or tagStandard41h12 [tag36h11]");
  app.add_option("--columns", board.columns, "Tags side by side [6]");
  app.add_option("--rows", board.rows, "Tags above each other [6]");
  app.add_option("--tag-size-mm", tag_size_mm,
                 "Distance between the detected corners: for tag36h11 the black edge,\n"
                 "for tagStandard41h12 the white square within the black ring [24]");
  const CLI::Option* spacing =
      app.add_option("--spacing", board.spacing,
                     "Gap between tags as a share of their size, Kalibr's tagSpacing [0.3; tagStandard41h12: 1]");
  app.add_option("--first-id", board.first_id,
                 "Number of the bottom left tag; numbers grow to the right, then upwards [0]");
  add_named_option(app, "--paper", in.paper, kPapers,
                   "a4, a3 or letter; landscape if the board fits only that way [a4]");
  add_sheet_options(app, in, {".pdf", ".svg", ".png", ".yaml"}, "Resolution of a PNG [300]",
                    ".pdf and .svg (vectors), .png, or .yaml (what calibrations read:\n"
                    "Kalibr's aprilgrid); may be given several times",
                    "The layout as JSON on standard output");
  return run_command(app, arguments, [&] {
    board.tag_size_m = tag_size_mm / 1000;
    if (!*spacing && board.family == TagFamily::tagStandard41h12) board.spacing = 1;
    if (in.outputs.empty() && !in.json) throw UsageError("give --output FILE");
    if (const Status s = board.validate(); !s.ok()) throw UsageError(s.message());

    const BoardPage sheet = require(layout(board, in.paper));
    std::vector<std::string> files;
    for (const std::string& path : in.outputs)
      require(path.ends_with(".yaml") ? write_output(path, tag_board_to_text(board))
                                      : write_pages({&sheet.page, 1}, path, in.dpi, files));
    if (in.json)
      std::cout << json_text(json_of(board, in, sheet)) << std::endl;
    else
      std::cout << board.tags() << " tags of " << to_string(board.family) << " on "
                << (sheet.landscape ? "landscape " : "") << in.paper.name << "; print at 100 % and measure the ruler\n";
    return kDone;
  });
}

}  // namespace lightwell::calibrate
