#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>
#include <string>

#include <lightwell/pixel.hpp>

#include "pose/marker_bodies.hpp"
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

}  // namespace lightwell::calibrate
