#include "tools/lightwell_calibrate/board_command.hpp"

#include <iostream>
#include <string>

#include "tools/lightwell_calibrate/arguments.hpp"
#include "tools/lightwell_calibrate/board_page.hpp"
#include "tools/lightwell_calibrate/json.hpp"
#include "tools/lightwell_calibrate/output.hpp"

namespace lightwell::calibrate {

namespace {

constexpr const char* kHelp = R"(lightwell-calibrate board: a board of AprilTags to print, true to scale.

  lightwell-calibrate board --output board.pdf
  lightwell-calibrate board --columns 6 --rows 8 --tag-size-mm 22 --spacing 0.3 --paper a4 --output board.pdf
  lightwell-calibrate board --columns 1 --rows 1 --tag-size-mm 160 --first-id 7 --output tag7.pdf
  lightwell-calibrate board --output board.pdf --output board.yaml --json

  --family F           tag36h11 or tagStandard41h12 [tag36h11]
  --columns N          tags side by side [6]
  --rows N             tags above each other [6]
  --tag-size-mm S      distance between the detected corners: for tag36h11 the black edge, for tagStandard41h12 the
                       white square within the black ring [24]
  --spacing R          gap between tags as a share of their size, Kalibr's tagSpacing [0.3; tagStandard41h12: 1]
  --first-id N         number of the bottom left tag; numbers grow to the right, then upwards [0]
  --paper P            a4, a3 or letter; landscape if the board fits only that way [a4]
  --dpi D              resolution of a PNG [300]
  --output FILE        .pdf and .svg (vectors), .png, or .yaml (what calibrations read: Kalibr's aprilgrid); may be
                       given several times
  --json               the layout as JSON on standard output
  --help               this text

The sheet has a description and a ruler. Print at 100 %, measure the ruler, and multiply the tag size in the board's
YAML by measured / 100 mm. Glue the board onto something flat: bent paper makes a calibration inaccurate.
Exit status: 0 done, 1 an input is wrong (standard error has the reason and the remedy), 2 wrong usage.
)";

struct Arguments {
  TagBoard board;
  Paper paper = kPapers[0];
  double dpi = 300;
  std::vector<std::string> outputs;
  bool json = false;
  bool help = false;
};

bool ends_with(const std::string& path, std::string_view ending) { return path.ends_with(ending); }

Result<Arguments> parse(std::span<char* const> words) {
  static const std::vector<std::string_view> kKnown = {
      "--family", "--columns", "--rows", "--tag-size-mm", "--spacing", "--first-id", "--paper", "--dpi", "--output"};
  const auto usage = [](const std::string& what) {
    return Status(StatusCode::invalid_argument, what + "; see --help");
  };
  const Result<std::vector<Argument>> all = parse_arguments(words, kKnown, {"--json"});
  if (!all) return all.status();
  Arguments out;
  bool spacing_given = false;
  for (const auto& [option, value] : *all) {
    const auto bad = [&] { return usage(option + ": '" + value + "' is not a valid value"); };
    const auto whole = [&](int& field) {
      const auto n = number<int>(value);
      field = n.value_or(field);
      return n.has_value();
    };
    const auto real = [&](double& field) {
      const auto n = number<double>(value);
      field = n.value_or(field);
      return n.has_value() && std::isfinite(*n);
    };
    if (option == "--help") {
      out.help = true;
      return out;
    }
    if (option.empty()) return usage("unexpected argument '" + value + "'");
    if (option == "--family") {
      const Result<TagFamily> family = parse_tag_family(value);
      if (!family) return usage("--family: " + family.status().message());
      out.board.family = *family;
    } else if (option == "--columns") {
      if (!whole(out.board.columns)) return bad();
    } else if (option == "--rows") {
      if (!whole(out.board.rows)) return bad();
    } else if (option == "--tag-size-mm") {
      if (!real(out.board.tag_size_m)) return bad();
      out.board.tag_size_m /= 1000;
    } else if (option == "--spacing") {
      if (!real(out.board.spacing)) return bad();
      spacing_given = true;
    } else if (option == "--first-id") {
      if (!whole(out.board.first_id)) return bad();
    } else if (option == "--paper") {
      const Result<Paper> paper = find_paper(value);
      if (!paper) return usage("--paper: " + paper.status().message());
      out.paper = *paper;
    } else if (option == "--dpi") {
      if (!real(out.dpi) || out.dpi < 36 || out.dpi > 2400)
        return usage("--dpi: '" + value + "' is not from 36 to 2400");
    } else if (option == "--output") {
      if (!ends_with(value, ".pdf") && !ends_with(value, ".svg") && !ends_with(value, ".png") &&
          !ends_with(value, ".yaml"))
        return usage("--output: '" + value + "' must end in .pdf, .svg, .png or .yaml");
      out.outputs.push_back(value);
    } else if (option == "--json") {
      out.json = true;
    }
  }
  if (!spacing_given && out.board.family == TagFamily::tagStandard41h12) out.board.spacing = 1;
  if (out.outputs.empty() && !out.json) return usage("give --output FILE");
  if (const Status s = out.board.validate(); !s.ok()) return usage(s.message());
  return out;
}

std::string to_json(const Arguments& arguments, const BoardPage& sheet) {
  const TagBoard& board = arguments.board;
  std::string out =
      "{\"family\": " + json_string(to_string(board.family)) + ", \"columns\": " + std::to_string(board.columns) +
      ", \"rows\": " + std::to_string(board.rows) + ", \"tag_size_m\": " + json_number(board.tag_size_m) +
      ", \"spacing\": " + json_number(board.spacing) + ", \"first_id\": " + std::to_string(board.first_id) +
      ", \"paper\": " + json_string(arguments.paper.name) + ", \"sheet_mm\": [" + json_number(sheet.page.width) + ", " +
      json_number(sheet.page.height) + "], \"origin_mm\": [" + json_number(sheet.origin_x_mm) + ", " +
      json_number(sheet.origin_y_mm) + "], \"files\": [";
  for (std::size_t i = 0; i < arguments.outputs.size(); ++i) out += (i ? ", " : "") + json_string(arguments.outputs[i]);
  return out + "]}\n";
}

Status write(const Arguments& arguments, const BoardPage& sheet, const std::string& path) {
  if (ends_with(path, ".png")) return write_page_png(sheet.page, arguments.dpi, path);
  if (ends_with(path, ".svg")) return write_output(path, page_to_svg(sheet.page));
  if (ends_with(path, ".yaml")) return write_output(path, tag_board_to_text(arguments.board));
  return write_output(path, page_to_pdf(sheet.page));
}

}  // namespace

int board_command(std::span<char* const> arguments) {
  const auto fail = [](const Status& s, int exit) {
    std::cerr << "lightwell-calibrate board: " << s.message() << "\n";
    return exit;
  };
  const Result<Arguments> parsed = parse(arguments);
  if (!parsed) return fail(parsed.status(), kUsage);
  if (parsed->help) {
    std::cout << kHelp;
    return kDone;
  }
  const Result<BoardPage> sheet = layout(parsed->board, parsed->paper);
  if (!sheet) return fail(sheet.status(), kBadInput);
  for (const std::string& path : parsed->outputs)
    if (const Status s = write(*parsed, *sheet, path); !s.ok()) return fail(s, kBadInput);
  if (parsed->json) {
    std::cout << to_json(*parsed, *sheet) << std::flush;
  } else {
    std::cout << parsed->board.tags() << " tags of " << to_string(parsed->board.family) << " on "
              << (sheet->landscape ? "landscape " : "") << parsed->paper.name
              << "; print at 100 % and measure the ruler\n";
  }
  return kDone;
}

}  // namespace lightwell::calibrate
