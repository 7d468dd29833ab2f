#include "tools/lightwell_calibrate/marker_sheet_command.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "pose/marker_bodies.hpp"
#include "tools/lightwell_calibrate/arguments.hpp"
#include "tools/lightwell_calibrate/json.hpp"
#include "tools/lightwell_calibrate/marker_net.hpp"
#include "tools/lightwell_calibrate/marker_sheet_page.hpp"
#include "tools/lightwell_calibrate/output.hpp"

namespace lightwell::calibrate {

namespace {

constexpr const char* kHelp =
    R"(lightwell-calibrate marker-sheet: a body with AprilTags for light estimation, to print, cut and fold.

  lightwell-calibrate marker-sheet --output sheet.pdf --output body.textproto
  lightwell-calibrate marker-sheet --body dodecahedron --size-mm 100 --paper-kind grey --paper a4 --output sheet.pdf
  lightwell-calibrate marker-sheet --body ball --size-mm 40 --output sheet.pdf --output ball.textproto
  lightwell-calibrate marker-sheet --size-mm 100 --ruler-mm 98.7 --output body.textproto

  --body B             dodecahedron, cube, icosahedron, or ball: a tag on a sheet with a matt ball behind it
                       [dodecahedron]
  --size-mm S          distance between opposite faces, or diameter of the ball [100; cube 60, ball 40]
  --paper-kind K       white: plain paper. grey: the quadrants around each tag are 100, 75, 50 and 25 % of the paper's
                       white, for lamps that saturate white paper [white]
  --paper P            a4, a3 or letter [a4]
  --family F           tag36h11 or tagStandard41h12 [tag36h11]
  --first-id N         number of face 0's tag; the others follow. Two bodies in one room need different numbers [0]
  --tag-size-mm T      distance between the detected corners [by the face; 24 for a dodecahedron of 100 mm]
  --ruler-mm R         measured length of the printed ruler: scales the .textproto to the print [100]
  --dpi D              resolution of PNGs [300]
  --output FILE        .pdf (all pages) or .svg (vectors), .png, or .textproto (the body, for lightwelld --estimator
                       marker). May be given several times. SVG and PNG have one file per page: sheet-1.svg, sheet-2.svg
  --json               the layout as JSON on standard output: mm from the top left of the page, y downwards
  --help               this text

How to make one:
  1. Print at 100 % ("actual size") on matt white paper or card of 160 to 200 g. Glossy paper reflects the lamp, thin
     paper bulges.
  2. Measure the ruler. If it is not 100 mm: print again without "fit to page", or give the measured length as
     --ruler-mm and write the .textproto again. An error of 1 % here is an error of 1 % in every distance.
  3. Score the dashed lines with a blunt knife along a ruler, cut along the solid ones.
  4. Fold every dashed line away from the print. Glue each tab beneath the face whose number it bears, flush with its
     edge. The numbers of the faces are below and to the left of the tags, small and underlined. Glue the last face with
     all remaining tabs at once.
  5. A ball: paint it matt white, glue it onto the cross, lay the sheet flat.
  6. Greys: printers differ by tens of per cent. Before folding, photograph the flat sheet in even light with a camera
     whose response is known (lightwell-calibrate photometry). The albedo of a quadrant is its linear value divided by
     that of the blank paper next to it, times 0.80: write it into the .textproto. The printed picture value is the sRGB
     encoding of albedo / 0.80: 255, 225, 188, 137.

Exit status: 0 done, 1 an input is wrong (standard error has the reason and the remedy), 2 wrong usage.
)";

enum class Body : std::uint8_t { dodecahedron, cube, icosahedron, ball };
struct BodyName {
  std::string_view name;
  Body body;
  double size_mm;
};
constexpr std::array<BodyName, 4> kBodies = {{{"dodecahedron", Body::dodecahedron, 100},
                                              {"cube", Body::cube, 60},
                                              {"icosahedron", Body::icosahedron, 100},
                                              {"ball", Body::ball, 40}}};

struct Arguments {
  BodyName body = kBodies[0];
  std::optional<double> size_mm, tag_size_mm, ruler_mm;
  PaperKind kind = PaperKind::white;
  Paper paper = kPapers[0];
  TagFamily family = TagFamily::tag36h11;
  int first_id = 0;
  double dpi = 300;
  std::vector<std::string> outputs;
  bool json = false;
  bool help = false;

  [[nodiscard]] double size() const { return size_mm.value_or(body.size_mm); }
};

bool is_body_file(const std::string& path) { return path.ends_with(".textproto"); }

Result<Arguments> parse(std::span<char* const> words) {
  static const std::vector<std::string_view> kKnown = {"--body",     "--size-mm",  "--paper-kind", "--paper",
                                                       "--family",   "--first-id", "--dpi",        "--tag-size-mm",
                                                       "--ruler-mm", "--output"};
  const auto usage = [](const std::string& what) {
    return Status(StatusCode::invalid_argument, what + "; see --help");
  };
  const Result<std::vector<Argument>> all = parse_arguments(words, kKnown, {"--json"});
  if (!all) return all.status();
  Arguments out;
  for (const auto& [option, value] : *all) {
    const auto bad = [&] { return usage(option + ": '" + value + "' is not a valid value"); };
    /// nullopt unless it is a number above 0 and at most `most`.
    const auto positive = [&](double most) {
      const auto n = number<double>(value);
      return n && *n > 0 && *n <= most ? n : std::nullopt;
    };
    if (option == "--help") {
      out.help = true;
      return out;
    }
    if (option.empty()) return usage("unexpected argument '" + value + "'");
    if (option == "--body") {
      const auto body =
          std::find_if(kBodies.begin(), kBodies.end(), [&](const BodyName& b) { return b.name == value; });
      if (body == kBodies.end())
        return usage("--body: '" + value + "' is not known; dodecahedron, cube, icosahedron and ball are");
      out.body = *body;
    } else if (option == "--size-mm") {
      if (!(out.size_mm = positive(10'000))) return bad();
    } else if (option == "--tag-size-mm") {
      if (!(out.tag_size_mm = positive(10'000))) return bad();
    } else if (option == "--ruler-mm") {
      // Other values are reading errors or inches.
      const auto n = number<double>(value);
      if (!n || !(*n >= 50 && *n <= 200)) return usage("--ruler-mm: '" + value + "' is not from 50 to 200");
      out.ruler_mm = *n;
    } else if (option == "--paper-kind") {
      const Result<PaperKind> kind = parse_paper_kind(value);
      if (!kind) return usage("--paper-kind: " + kind.status().message());
      out.kind = *kind;
    } else if (option == "--paper") {
      const Result<Paper> paper = find_paper(value);
      if (!paper) return usage("--paper: " + paper.status().message());
      out.paper = *paper;
    } else if (option == "--family") {
      const Result<TagFamily> family = parse_tag_family(value);
      if (!family) return usage("--family: " + family.status().message());
      out.family = *family;
    } else if (option == "--first-id") {
      const auto n = number<int>(value);
      if (!n) return bad();
      out.first_id = *n;
    } else if (option == "--dpi") {
      const auto n = number<double>(value);
      if (!n || !(*n >= 36 && *n <= 2400)) return usage("--dpi: '" + value + "' is not from 36 to 2400");
      out.dpi = *n;
    } else if (option == "--output") {
      if (!value.ends_with(".pdf") && !value.ends_with(".svg") && !value.ends_with(".png") && !is_body_file(value))
        return usage("--output: '" + value + "' must end in .pdf, .svg, .png or .textproto");
      out.outputs.push_back(value);
    } else if (option == "--json") {
      out.json = true;
    }
  }
  if (out.outputs.empty() && !out.json) return usage("give --output FILE");
  const bool sheet = out.json || !std::all_of(out.outputs.begin(), out.outputs.end(), is_body_file);
  if (out.ruler_mm && sheet)
    return usage("--ruler-mm describes a printed sheet; it goes with --output BODY.textproto alone");
  return out;
}

/// The body for the arguments. `tag_size_m` 0: chosen by the face.
Result<MarkerBody> make_body(const Arguments& arguments, double size_m, double tag_size_m) {
  if (arguments.body.body == Body::ball) {
    BallOnTagOptions options;
    options.ball_diameter_m = size_m;
    options.paper = arguments.kind;
    options.family = arguments.family;
    options.id = arguments.first_id;
    options.tag_size_m = tag_size_m;
    return make_ball_on_tag(options);
  }
  const SolidOptions options{size_m, arguments.kind, arguments.family, arguments.first_id, tag_size_m};
  if (arguments.body.body == Body::cube) return make_cube(options);
  if (arguments.body.body == Body::icosahedron) return make_icosahedron(options);
  return make_dodecahedron(options);
}

/// The body as printed, scaled by --ruler-mm / 100. A ball is not printed, so it keeps its diameter and its height
/// above the sheet; only the tag and its distance scale.
Result<MarkerBody> body_of(const Arguments& arguments) {
  const double size = arguments.size() / 1000;
  Result<MarkerBody> nominal = make_body(arguments, size, arguments.tag_size_mm.value_or(0) / 1000);
  if (!nominal || !arguments.ruler_mm) return nominal;
  const double scale = *arguments.ruler_mm / kRulerLength_mm;
  if (arguments.body.body != Body::ball) return make_body(arguments, size * scale, nominal->tag_size_m * scale);
  MarkerFace& sheet = nominal->faces[0];
  const auto grow = [&](FaceOutline& outline) {
    for (FacePoint& p : outline) p.x *= scale, p.y *= scale;
  };
  nominal->tag_size_m *= scale;
  sheet.body_face.translation.z *= scale;
  grow(sheet.outline);
  for (MarkerPatch& patch : sheet.patches) grow(patch.outline);
  return nominal;
}

/// File name of a page: "sheet.svg" becomes "sheet-2.svg" for page 2 of several.
std::string page_path(const std::string& path, std::size_t page, std::size_t pages) {
  if (pages == 1) return path;
  return path.substr(0, path.size() - 4) + "-" + std::to_string(page + 1) + path.substr(path.size() - 4);
}

std::string to_json(const Arguments& arguments, const MarkerBody& body, const Net& net,
                    const std::vector<std::string>& files) {
  const auto id = [&](std::size_t face) { return std::to_string(body.faces[face].tag_id); };
  const auto point = [](PagePoint p) { return json_numbers(std::array{p.x, p.y}); };
  const auto list = [](const auto& items, const auto& one) {
    std::string out;
    for (const auto& item : items) out += (out.empty() ? "" : ", ") + one(item);
    return "[" + out + "]";
  };
  const auto page = [&](const NetPage& p) {
    return "{\"sheet_mm\": " + json_numbers(std::array{p.width, p.height}) + ", \"faces\": " +
           list(p.faces,
                [&](const NetFace& f) {
                  return "{\"tag_id\": " + id(f.face) + ", \"center_mm\": " + point(f.center) +
                         ", \"turn_deg\": " + json_number(f.turn_rad * 180 / std::numbers::pi) + "}";
                }) +
           ", \"folds\": " +
           list(p.folds,
                [&](const NetFold& f) {
                  return "{\"between\": [" + id(f.a) + ", " + id(f.b) + "], \"from_mm\": " + point(f.from) +
                         ", \"to_mm\": " + point(f.to) + "}";
                }) +
           ", \"tabs\": " +
           list(p.tabs,
                [&](const NetTab& t) {
                  return "{\"on\": " + id(t.on) + ", \"under\": " + id(t.under) +
                         ", \"outline_mm\": " + list(t.outline, point) + "}";
                }) +
           "}";
  };
  return "{\"name\": " + json_string(body.name) + ", \"size_m\": " + json_number(arguments.size() / 1000) +
         ", \"tag_family\": " + json_string(body.tag_family) + ", \"tag_size_m\": " + json_number(body.tag_size_m) +
         ", \"paper\": " + json_string(arguments.paper.name) + ", \"pages\": " + list(net.pages, page) +
         ", \"files\": " + list(files, [](const std::string& f) { return json_string(f); }) + "}\n";
}

struct Sheet {
  Net net;
  std::vector<Page> pages;
};

Result<Sheet> sheet_of(const Arguments& arguments, const MarkerBody& body) {
  Result<Net> net = make_net(body, arguments.paper);
  if (!net) {
    const double fits = std::floor(10 * arguments.size() * largest_scale(body, arguments.paper)) / 10;
    return Status(net.status().code(), body.name + ": " + net.status().message() + "; --size-mm " + brief(fits) +
                                           " would, or larger --paper");
  }
  Result<std::vector<Page>> pages = draw_net(body, *net);
  if (!pages) return pages.status();
  return Sheet{*std::move(net), *std::move(pages)};
}

/// Writes one output and adds its files to `files`.
Status write(const Arguments& arguments, const MarkerBody& body, const Sheet& sheet, const std::string& path,
             std::vector<std::string>& files) {
  if (is_body_file(path) || path.ends_with(".pdf")) {
    files.push_back(path);
    return write_output(path, is_body_file(path) ? marker_body_to_text(body) : pages_to_pdf(sheet.pages));
  }
  for (std::size_t i = 0; i < sheet.pages.size(); ++i) {
    files.push_back(page_path(path, i, sheet.pages.size()));
    const Status s = path.ends_with(".png") ? write_page_png(sheet.pages[i], arguments.dpi, files.back())
                                            : write_output(files.back(), page_to_svg(sheet.pages[i]));
    if (!s.ok()) return s;
  }
  return {};
}

}  // namespace

int marker_sheet_command(std::span<char* const> arguments) {
  const auto fail = [](const Status& s, int exit) {
    std::cerr << "lightwell-calibrate marker-sheet: " << s.message() << "\n";
    return exit;
  };
  const Result<Arguments> parsed = parse(arguments);
  if (!parsed) return fail(parsed.status(), kUsage);
  if (parsed->help) {
    std::cout << kHelp;
    return kDone;
  }
  const Result<MarkerBody> body = body_of(*parsed);
  if (!body) return fail(body.status(), kBadInput);
  Sheet sheet;
  // A body file alone need not fit a paper.
  if (parsed->json || !std::all_of(parsed->outputs.begin(), parsed->outputs.end(), is_body_file)) {
    Result<Sheet> made = sheet_of(*parsed, *body);
    if (!made) return fail(made.status(), kBadInput);
    sheet = *std::move(made);
  }
  std::vector<std::string> files;
  for (const std::string& path : parsed->outputs)
    if (const Status s = write(*parsed, *body, sheet, path, files); !s.ok()) return fail(s, kBadInput);
  if (parsed->json) {
    std::cout << to_json(*parsed, *body, sheet.net, files) << std::flush;
  } else if (!sheet.pages.empty()) {
    const std::size_t pages = sheet.pages.size();
    std::cout << body->name << ": " << pages << (pages == 1 ? " page of " : " pages of ") << parsed->paper.name
              << "; print at 100 % and measure the ruler\n";
  } else {
    std::cout << body->name << ": tags of " << brief(1000 * body->tag_size_m) << " mm\n";
  }
  return kDone;
}

}  // namespace lightwell::calibrate
