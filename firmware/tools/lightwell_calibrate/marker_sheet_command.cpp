#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iostream>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/pixel.hpp>

#include "pose/marker_bodies.hpp"
#include "tools/command_line.hpp"
#include "tools/lightwell_calibrate/commands.hpp"
#include "tools/lightwell_calibrate/marker_net.hpp"

namespace lightwell::calibrate {
namespace {

constexpr double kLine = 0.15, kDash = 4;
using Outlines = std::vector<std::vector<PagePoint>>;

/// Maps rectangles from a face's frame in mm, y downwards, to the sheet.
PageArea placed(const NetFace& face, const std::vector<Rectangle>& rectangles) {
  PageArea out = black_area(rectangles);
  for (auto& outline : out.outlines)
    for (PagePoint& p : outline) p = face.on_sheet({p.x / 1000, -p.y / 1000});
  return out;
}

void add_line(Outlines& to, PagePoint p, PagePoint q) {
  const double length = std::hypot(q.x - p.x, q.y - p.y);
  if (!(length > 0)) return;
  const double nx = -(q.y - p.y) / length * kLine / 2, ny = (q.x - p.x) / length * kLine / 2;
  to.push_back({{p.x - nx, p.y - ny}, {q.x - nx, q.y - ny}, {q.x + nx, q.y + ny}, {p.x + nx, p.y + ny}});
}

void add_dashes(Outlines& to, PagePoint p, PagePoint q) {
  const double count = std::max(1.0, std::round(std::hypot(q.x - p.x, q.y - p.y) / kDash));
  const auto at = [&](double t) { return PagePoint{p.x + t * (q.x - p.x), p.y + t * (q.y - p.y)}; };
  for (double i = 0; i < count; ++i) add_line(to, at((i + 0.2) / count), at((i + 0.8) / count));
}

/// Draws the lighter greys first, extending beneath the darker ones, so that no white line shows between them.
void draw_greys(const MarkerBody& body, const std::vector<NetFace>& faces, Page& page) {
  std::vector<PageArea> patches;
  std::set<double, std::greater<>> greys;
  for (const NetFace& face : faces)
    for (const MarkerPatch& patch : body.faces[face.face].patches) {
      const double grey = printed_grey(patch.albedo[1]);
      if (grey >= 1) continue;
      greys.insert(grey);
      std::vector<PagePoint>& outline = patches.emplace_back(PageArea{{{}}, grey}).outlines[0];
      for (const FacePoint& p : patch.outline) outline.push_back(face.on_sheet(p));
    }
  for (const double lightest : greys) {
    PageArea& area = page.areas.emplace_back(PageArea{{}, lightest});
    for (const PageArea& patch : patches)
      if (patch.grey <= lightest) area.outlines.push_back(patch.outlines[0]);
  }
}

Status draw_tag(const MarkerBody& body, const NetFace& placed_face, Page& page) {
  const Result<TagFamily> family = parse_tag_family(body.tag_family);
  if (!family) return family.status();
  const int id = body.faces[placed_face.face].tag_id;
  const Result<TagBitmap> bitmap = tag_bitmap(*family, id);
  if (!bitmap) return bitmap.status();
  const double cell = 1000 * body.tag_size_m / shape_of(*family).edge_cells, half = bitmap->cells * cell / 2;
  page.areas.push_back(placed(placed_face, tag_rectangles(*bitmap, -half, -half, cell)));
  std::vector<Rectangle> number = digits(id, 0.8 * cell, 0.6 * cell);
  const double corner = 500 * white_square_m(*family, body.tag_size_m) - cell / 2;
  for (Rectangle& r : number) r.x -= corner, r.y += corner;
  page.areas.push_back(placed(placed_face, number));
  return {};
}

/// The number on a tab is upright with respect to its face.
void draw_tab(const MarkerBody& body, const NetTab& tab, Page& page) {
  const PagePoint from = tab.outline.front(), to = tab.outline.back();
  NetFace middle;
  for (const PagePoint& p : tab.outline) middle.center.x += p.x / 4, middle.center.y += p.y / 4;
  middle.turn_rad = std::atan2(from.y - to.y, to.x - from.x);
  const double wide = std::hypot(tab.outline[2].x - tab.outline[1].x, tab.outline[2].y - tab.outline[1].y);
  const double deep = 2 * std::hypot(middle.center.x - (from.x + to.x) / 2, middle.center.y - (from.y + to.y) / 2);
  page.areas.push_back(placed(middle, digits(body.faces[tab.under].tag_id, 0.8 * wide, 0.5 * deep)));
}

/// The position of the ball: a cross, and a circle of its diameter.
void draw_ball_place(const MarkerBody& body, const NetFace& sheet, Page& page) {
  const Vec3d at = transformed(inverse(body.faces[sheet.face].body_face), body.ball->center);
  const double r = body.ball->radius_m;
  const auto point = [&](double x, double y) { return sheet.on_sheet({at.x + x, at.y + y}); };
  Outlines lines;
  add_line(lines, point(-r / 2, 0), point(r / 2, 0));
  add_line(lines, point(0, -r / 2), point(0, r / 2));
  constexpr int kSteps = 96;
  for (int i = 0; i < kSteps; i += 2) {
    const double a = 2 * std::numbers::pi * i / kSteps, b = 2 * std::numbers::pi * (i + 1) / kSteps;
    add_line(lines, point(r * std::cos(a), r * std::sin(a)), point(r * std::cos(b), r * std::sin(b)));
  }
  page.areas.push_back({std::move(lines), 0});
}

void draw_words(const MarkerBody& body, const Net& net, std::size_t index, Page& page) {
  double y = page.height - kPrinterMargin_mm - kNetFooter + 4;
  const auto line = [&](const std::string& text) {
    page.texts.push_back({text, kPrinterMargin_mm + 2, y, 2.6}), y += 4;
  };
  std::string faces;
  for (const NetFace& f : net.pages[index].faces)
    faces += (faces.empty() ? "" : ", ") + std::to_string(body.faces[f.face].tag_id);
  line("Lightwell marker: " + body.name + ", " + body.tag_family + " of " + brief(1000 * body.tag_size_m) + " mm.");
  line("Page " + std::to_string(index + 1) + " of " + std::to_string(net.pages.size()) +
       (net.pages[index].faces.size() == 1 ? ": tag " : ": tags ") + faces + ".");
  line("Print at 100 % (\"actual size\") on matt white paper of 160 to 200 g; the ruler must be 100 mm long.");
  if (body.ball)
    line("Cut along the solid lines and lay the sheet flat. Glue a matt white ball of " +
         brief(2000 * body.ball->radius_m) + " mm onto the cross.");
  else
    line(
        "Cut solid lines, fold dashed ones away from the print, glue each tab beneath the face whose number it bears.");
  bool grey = false;
  for (const MarkerFace& face : body.faces)
    for (const MarkerPatch& patch : face.patches) grey = grey || printed_grey(patch.albedo[1]) < 1;
  if (grey)
    line("Printers differ: the greys' albedos must be checked, and corrected in the body file (marker-sheet --help).");
  draw_ruler(kPrinterMargin_mm + 2, page.height - kPrinterMargin_mm - 1.5, page);
}

constexpr const char* kFooter =
    R"(Examples:
  lightwell-calibrate marker-sheet --output sheet.pdf --output body.textproto
  lightwell-calibrate marker-sheet --body dodecahedron --size-mm 100 --paper-kind grey --paper a4 --output sheet.pdf
  lightwell-calibrate marker-sheet --body ball --size-mm 40 --output sheet.pdf --output ball.textproto
  lightwell-calibrate marker-sheet --size-mm 100 --ruler-mm 98.7 --output body.textproto

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

Exit status: 0 done, 1 an input is wrong (standard error has the reason and the remedy), 2 wrong usage.)";

struct BodyName {
  std::string_view name;
  double size_mm;
  Result<MarkerBody> (*make_solid)(const SolidOptions&);  ///< Null: the ball.
};
constexpr std::array<BodyName, 4> kBodies = {{{"dodecahedron", 100, make_dodecahedron},
                                              {"cube", 60, make_cube},
                                              {"icosahedron", 100, make_icosahedron},
                                              {"ball", 40, nullptr}}};
std::string_view to_string(const BodyName& body) { return body.name; }

struct Arguments : SheetOptions {
  BodyName body = kBodies[0];
  std::optional<double> size_mm, tag_size_mm, ruler_mm;
  PaperKind kind = PaperKind::white;
  TagFamily family = TagFamily::tag36h11;
  int first_id = 0;

  [[nodiscard]] double size() const { return size_mm.value_or(body.size_mm); }
};

bool is_body_file(const std::string& path) { return path.ends_with(".textproto"); }

/// The body for the arguments. `tag_size_m` 0: chosen by the face.
MarkerBody make_body(const Arguments& arguments, double size_m, double tag_size_m) {
  if (arguments.body.make_solid != nullptr)
    return require(
        arguments.body.make_solid({size_m, arguments.kind, arguments.family, arguments.first_id, tag_size_m}));
  BallOnTagOptions options;
  options.ball_diameter_m = size_m;
  options.paper = arguments.kind;
  options.family = arguments.family;
  options.id = arguments.first_id;
  options.tag_size_m = tag_size_m;
  return require(make_ball_on_tag(options));
}

/// The body as printed, scaled by --ruler-mm / 100; of a ball, which is not printed, only the tag and its distance.
MarkerBody body_of(const Arguments& arguments) {
  const double size = arguments.size() / 1000;
  MarkerBody body = make_body(arguments, size, arguments.tag_size_mm.value_or(0) / 1000);
  if (!arguments.ruler_mm) return body;
  const double scale = *arguments.ruler_mm / kRulerLength_mm;
  if (arguments.body.make_solid != nullptr) return make_body(arguments, size * scale, body.tag_size_m * scale);
  MarkerFace& sheet = body.faces[0];
  const auto grow = [&](FaceOutline& outline) {
    for (FacePoint& p : outline) p.x *= scale, p.y *= scale;
  };
  body.tag_size_m *= scale;
  sheet.body_face.translation.z *= scale;
  grow(sheet.outline);
  for (MarkerPatch& patch : sheet.patches) grow(patch.outline);
  return body;
}

nlohmann::ordered_json json_of(PagePoint p) { return json_numbers(std::array{p.x, p.y}); }

nlohmann::ordered_json json_of(const NetPage& page, const MarkerBody& body) {
  const auto id = [&](std::size_t face) { return body.faces[face].tag_id; };
  nlohmann::ordered_json faces = nlohmann::ordered_json::array(), folds = faces, tabs = faces;
  for (const NetFace& f : page.faces)
    faces.push_back({{"tag_id", id(f.face)},
                     {"center_mm", json_of(f.center)},
                     {"turn_deg", json_number(f.turn_rad * 180 / std::numbers::pi)}});
  for (const NetFold& f : page.folds)
    folds.push_back(
        {{"between", std::array{id(f.a), id(f.b)}}, {"from_mm", json_of(f.from)}, {"to_mm", json_of(f.to)}});
  for (const NetTab& t : page.tabs) {
    nlohmann::ordered_json outline = nlohmann::ordered_json::array();
    for (const PagePoint& p : t.outline) outline.push_back(json_of(p));
    tabs.push_back({{"on", id(t.on)}, {"under", id(t.under)}, {"outline_mm", std::move(outline)}});
  }
  return {{"sheet_mm", json_numbers(std::array{page.width, page.height})},
          {"faces", std::move(faces)},
          {"folds", std::move(folds)},
          {"tabs", std::move(tabs)}};
}

nlohmann::ordered_json json_of(const Arguments& arguments, const MarkerBody& body, const Net& net,
                               const std::vector<std::string>& files) {
  nlohmann::ordered_json pages = nlohmann::ordered_json::array();
  for (const NetPage& page : net.pages) pages.push_back(json_of(page, body));
  return {{"name", body.name},
          {"size_m", json_number(arguments.size() / 1000)},
          {"tag_family", body.tag_family},
          {"tag_size_m", json_number(body.tag_size_m)},
          {"paper", arguments.paper.name},
          {"pages", std::move(pages)},
          {"files", files}};
}

Net net_of(const Arguments& arguments, const MarkerBody& body) {
  Result<Net> net = make_net(body, arguments.paper);
  if (net) return *std::move(net);
  const double fits = std::floor(10 * arguments.size() * largest_scale(body, arguments.paper)) / 10;
  throw InputError({net.status().code(), body.name + ": " + net.status().message() + "; --size-mm " + brief(fits) +
                                             " would, or larger --paper"});
}

}  // namespace

double printed_grey(double albedo) {
  return albedo >= kPaperAlbedo ? 1 : linear_to_srgb(std::max(0.0, albedo / kPaperAlbedo));
}

Result<std::vector<Page>> draw_net(const MarkerBody& body, const Net& net) {
  std::vector<Page> out;
  for (std::size_t i = 0; i < net.pages.size(); ++i) {
    const NetPage& sheet = net.pages[i];
    Page page;
    page.width = sheet.width;
    page.height = sheet.height;
    draw_greys(body, sheet.faces, page);
    for (const NetFace& face : sheet.faces)
      if (const Status s = draw_tag(body, face, page); !s.ok()) return s;
    Outlines lines;
    for (const auto& cut : sheet.cuts) add_line(lines, cut[0], cut[1]);
    for (const NetFold& fold : sheet.folds) add_dashes(lines, fold.from, fold.to);
    for (const NetTab& tab : sheet.tabs) {
      add_dashes(lines, tab.outline.front(), tab.outline.back());
      for (std::size_t k = 1; k < tab.outline.size(); ++k) add_line(lines, tab.outline[k - 1], tab.outline[k]);
      draw_tab(body, tab, page);
    }
    page.areas.push_back({std::move(lines), 0});
    draw_words(body, net, i, page);
    if (body.ball) draw_ball_place(body, sheet.faces.front(), page);
    out.push_back(std::move(page));
  }
  return out;
}

int marker_sheet_command(const std::vector<std::string>& arguments) {
  CLI::App app{"A body with AprilTags for light estimation, to print, cut and fold.",
               "lightwell-calibrate marker-sheet"};
  app.footer(kFooter);
  Arguments in;
  const CLI::Validator size =
      number_where("above 0 and at most 10000", [](double mm) { return mm > 0 && mm <= 10'000; });
  add_named_option(app, "--body", in.body, kBodies,
                   "dodecahedron, cube, icosahedron, or ball: a tag on a sheet with a matt ball behind it\n"
                   "[dodecahedron]");
  app.add_option("--size-mm", in.size_mm,
                 "Distance between opposite faces, or diameter of the ball [100; cube 60, ball 40]")
      ->check(size);
  add_parsed_option(app, "--paper-kind", in.kind, parse_paper_kind,
                    "white: plain paper. grey: the quadrants around each tag are 100, 75, 50 and 25 % of\n"
                    "the paper's white, for lamps that saturate white paper [white]");
  add_named_option(app, "--paper", in.paper, kPapers, "a4, a3 or letter [a4]");
  add_parsed_option(app, "--family", in.family, parse_tag_family, "tag36h11 or tagStandard41h12 [tag36h11]");
  app.add_option("--first-id", in.first_id,
                 "Number of face 0's tag; the others follow. Two bodies in one room need different numbers [0]");
  app.add_option("--tag-size-mm", in.tag_size_mm,
                 "Distance between the detected corners [by the face; 24 for a dodecahedron of 100 mm]")
      ->check(size);
  // Other lengths are reading errors or inches.
  app.add_option("--ruler-mm", in.ruler_mm,
                 "Measured length of the printed ruler: scales the .textproto to the print [100]")
      ->check(number_where("from 50 to 200", [](double mm) { return mm >= 50 && mm <= 200; }));
  add_sheet_options(app, in, {".pdf", ".svg", ".png", ".textproto"}, "Resolution of PNGs [300]",
                    ".pdf (all pages) or .svg (vectors), .png, or .textproto (the body, for lightwelld\n"
                    "--estimator marker). May be given several times. SVG and PNG have one file per page:\n"
                    "sheet-1.svg, sheet-2.svg",
                    "The layout as JSON on standard output: mm from the top left of the page, y downwards");
  return run_command(app, arguments, [&] {
    if (in.outputs.empty() && !in.json) throw UsageError("give --output FILE");
    // A body file alone need not fit a paper.
    const bool drawn = in.json || !std::ranges::all_of(in.outputs, is_body_file);
    if (in.ruler_mm && drawn)
      throw UsageError("--ruler-mm describes a printed sheet; it goes with --output BODY.textproto alone");

    const MarkerBody body = body_of(in);
    const Net net = drawn ? net_of(in, body) : Net();
    const std::vector<Page> pages = require(draw_net(body, net));
    std::vector<std::string> files;
    for (const std::string& path : in.outputs) {
      if (is_body_file(path)) files.push_back(path);
      require(is_body_file(path) ? write_output(path, marker_body_to_text(body))
                                 : write_pages(pages, path, in.dpi, files));
    }
    if (in.json)
      std::cout << json_text(json_of(in, body, net, files)) << std::endl;
    else if (drawn)
      std::cout << body.name << ": " << pages.size() << (pages.size() == 1 ? " page of " : " pages of ")
                << in.paper.name << "; print at 100 % and measure the ruler\n";
    else
      std::cout << body.name << ": tags of " << brief(1000 * body.tag_size_m) << " mm\n";
    return kDone;
  });
}

}  // namespace lightwell::calibrate
