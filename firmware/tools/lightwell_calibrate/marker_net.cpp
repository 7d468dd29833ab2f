#include "tools/lightwell_calibrate/marker_net.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <ranges>
#include <set>

namespace lightwell::calibrate {

namespace {

constexpr double kMm = 1000;
/// Depth of a tab relative to its edge, and the maximum in mm.
constexpr double kTabShare = 0.16, kMaxTabDepth_mm = 7;
/// Distance between pieces of a page, mm.
constexpr double kGap = 4;
/// Overlaps of less depth are rounding errors, mm.
constexpr double kTouch = 1e-6;

using Outline = std::vector<PagePoint>;

struct Box {
  double x0 = std::numeric_limits<double>::max(), y0 = x0, x1 = -x0, y1 = -x0;

  void hold(const Outline& outline) {
    for (const PagePoint& p : outline) {
      x0 = std::min(x0, p.x), x1 = std::max(x1, p.x);
      y0 = std::min(y0, p.y), y1 = std::max(y1, p.y);
    }
  }
  [[nodiscard]] double width() const { return x1 - x0; }
  [[nodiscard]] double height() const { return y1 - y0; }
};

/// Whether two convex outlines overlap by more than an edge: no side of either separates them.
bool overlap(const Outline& p, const Outline& q) {
  for (const Outline* sides : {&p, &q})
    for (std::size_t i = 0; i < sides->size(); ++i) {
      const PagePoint &a = (*sides)[i], &b = (*sides)[(i + 1) % sides->size()];
      const double length = std::hypot(b.x - a.x, b.y - a.y);
      const double nx = (b.y - a.y) / length, ny = -(b.x - a.x) / length;
      const auto range = [&](const Outline& o) {
        return std::ranges::minmax(o | std::views::transform([&](const PagePoint& v) { return nx * v.x + ny * v.y; }));
      };
      const auto [p0, p1] = range(p);
      const auto [q0, q1] = range(q);
      if (p1 <= q0 + kTouch || q1 <= p0 + kTouch) return false;
    }
  return true;
}

/// The edge that two faces share, with `a` as its first face; nullopt if they share none.
std::optional<SharedEdge> edge_between(const std::vector<SharedEdge>& edges, std::size_t a, std::size_t b) {
  for (const SharedEdge& e : edges) {
    if (e.a == a && e.b == b) return e;
    if (e.a == b && e.b == a) return SharedEdge{e.b, e.edge_b, e.a, e.edge_a};
  }
  return std::nullopt;
}

/// Faces of a piece; the first one is laid first.
using Group = std::vector<std::size_t>;

struct Piece : NetParts {
  Box box;
};

/// A connected piece of the net, laid flat, before it is placed on a page.
class Unfolding {
 public:
  Unfolding(const MarkerBody& body, const std::vector<SharedEdge>& edges) : body_(body), edges_(edges) {}

  /// nullopt if a group is not connected, or faces or tabs would overlap.
  [[nodiscard]] std::optional<std::vector<Piece>> pieces(const std::vector<Group>& groups, double turn_rad) const {
    std::vector<Piece> out;
    ClosedEdges closed;
    for (const Group& group : groups) {
      const Piece& piece = out.emplace_back(unfold(group, turn_rad, closed));
      if (piece.faces.size() < group.size()) return std::nullopt;
      for (std::size_t i = 0; i < piece.faces.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
          if (overlap(outline_of(piece.faces[i]), outline_of(piece.faces[j]))) return std::nullopt;
    }
    for (const SharedEdge& edge : edges_)
      if (!closed.contains({edge.a, edge.edge_a}) && !add_tab(edge, out, closed)) return std::nullopt;
    for (Piece& piece : out)
      for (const NetFace& placed : piece.faces)
        for (std::size_t i = 0; i < body_.faces[placed.face].outline.size(); ++i)
          if (!closed.contains({placed.face, i})) piece.cuts.push_back(edge_of(placed, i));
    return out;
  }

 private:
  /// Edges of faces that are folded or have a tab: index of the face and of its edge.
  using ClosedEdges = std::set<std::pair<std::size_t, std::size_t>>;

  [[nodiscard]] Outline outline_of(const NetFace& placed) const {
    Outline out;
    for (const FacePoint& p : body_.faces[placed.face].outline) out.push_back(placed.on_sheet(p));
    return out;
  }

  /// The ends of an edge on the sheet, in the order of the outline.
  [[nodiscard]] std::array<PagePoint, 2> edge_of(const NetFace& placed, std::size_t edge) const {
    const FaceOutline& o = body_.faces[placed.face].outline;
    return {placed.on_sheet(o[edge]), placed.on_sheet(o[(edge + 1) % o.size()])};
  }

  /// Breadth-first from the first face: each face is connected to the first neighbour that was laid.
  [[nodiscard]] Piece unfold(const Group& group, double turn_rad, ClosedEdges& closed) const {
    Piece out;
    const auto lay = [&](const NetFace& face) {
      out.faces.push_back(face);
      out.box.hold(outline_of(face));
    };
    lay({group[0], {0, 0}, turn_rad});
    for (std::size_t done = 0; done < out.faces.size(); ++done)
      for (const std::size_t child : group) {
        const std::size_t parent = out.faces[done].face;
        const std::optional<SharedEdge> edge = edge_between(edges_, parent, child);
        if (!edge || std::ranges::find(out.faces, child, &NetFace::face) != out.faces.end()) continue;
        // The child's edge has the opposite direction.
        const auto [to, from] = edge_of(out.faces[done], edge->edge_a);
        const FaceOutline& o = body_.faces[child].outline;
        const FacePoint p = o[edge->edge_b], q = o[(edge->edge_b + 1) % o.size()];
        NetFace face{child, {0, 0}, std::atan2(from.y - to.y, to.x - from.x) - std::atan2(q.y - p.y, q.x - p.x)};
        const PagePoint there = face.on_sheet(p);
        face.center = {from.x - there.x, from.y - there.y};
        out.folds.push_back({parent, child, from, to});
        closed.insert({{edge->a, edge->edge_a}, {edge->b, edge->edge_b}});
        lay(face);
      }
    return out;
  }

  struct Choice {
    Piece* piece = nullptr;
    NetTab tab;
    double growth = 0;
  };

  /// A trapezoidal tab if it fits, otherwise one with pointed ends for a narrow gap.
  [[nodiscard]] std::optional<Choice> tab_on(std::size_t on, std::size_t edge, std::size_t under,
                                             std::vector<Piece>& pieces) const {
    for (Piece& piece : pieces) {
      const auto placed = std::ranges::find(piece.faces, on, &NetFace::face);
      if (placed == piece.faces.end()) continue;
      const auto [from, to] = edge_of(*placed, edge);
      const double length = std::hypot(to.x - from.x, to.y - from.y),
                   deep = std::min(kMaxTabDepth_mm, kTabShare * length);
      const double ux = (to.x - from.x) / length, uy = (to.y - from.y) / length;
      // The outline is counter-clockwise on the printed side: its outside is right of an edge, (-uy, ux), y down.
      for (const double end_deg : {60.0, 45.0, 32.0}) {
        const double in = deep / std::tan(end_deg * std::numbers::pi / 180);
        const Outline outline = {from,
                                 {from.x + in * ux - deep * uy, from.y + in * uy + deep * ux},
                                 {to.x - in * ux - deep * uy, to.y - in * uy + deep * ux},
                                 to};
        if (!fits(outline, piece)) continue;
        Box larger = piece.box;
        larger.hold(outline);
        return Choice{
            &piece, {on, under, outline}, larger.width() * larger.height() - piece.box.width() * piece.box.height()};
      }
      return std::nullopt;
    }
    return std::nullopt;
  }

  [[nodiscard]] bool fits(const Outline& tab, const Piece& piece) const {
    for (const NetFace& f : piece.faces)
      if (overlap(tab, outline_of(f))) return false;
    return std::none_of(piece.tabs.begin(), piece.tabs.end(), [&](const NetTab& t) { return overlap(tab, t.outline); });
  }

  /// On the side where the bounding box grows less.
  [[nodiscard]] bool add_tab(const SharedEdge& edge, std::vector<Piece>& pieces, ClosedEdges& closed) const {
    std::optional<Choice> best = tab_on(edge.a, edge.edge_a, edge.b, pieces);
    std::optional<Choice> other = tab_on(edge.b, edge.edge_b, edge.a, pieces);
    if (!best || (other && other->growth < best->growth - kTouch)) best = std::move(other);
    if (!best) return false;
    const bool on_a = best->tab.on == edge.a;
    closed.insert({best->tab.on, on_a ? edge.edge_a : edge.edge_b});
    best->piece->box.hold(best->tab.outline);
    best->piece->tabs.push_back(std::move(best->tab));
    return true;
  }

  const MarkerBody& body_;
  const std::vector<SharedEdge>& edges_;
};

/// Divisions of a body into pieces, those with the fewest pieces first.
std::vector<std::vector<Group>> ways(std::size_t faces) {
  std::vector<std::vector<Group>> out;
  Group all(faces);
  std::iota(all.begin(), all.end(), std::size_t{0});
  if (faces == 6) {
    out.push_back({{1, 0, 2, 4, 5, 3}});    // A cross.
    out.push_back({{1, 0, 5}, {3, 2, 4}});  // Two strips around each other.
  } else if (faces > 6 && faces % 2 == 0) {
    const auto middle = all.begin() + static_cast<std::ptrdiff_t>(faces / 2);
    out.push_back({{all.begin(), middle}, {all.rbegin(), std::make_reverse_iterator(middle)}});
  }
  out.emplace_back();
  for (const std::size_t face : all) out.back().push_back({face});
  return out;
}

void move(Piece& piece, double dx, double dy) {
  const auto by = [&](PagePoint& p) { p.x += dx, p.y += dy; };
  for (NetFace& f : piece.faces) by(f.center);
  for (NetFold& f : piece.folds) by(f.from), by(f.to);
  for (NetTab& t : piece.tabs)
    for (PagePoint& p : t.outline) by(p);
  for (auto& cut : piece.cuts) by(cut[0]), by(cut[1]);
  piece.box.x0 += dx, piece.box.x1 += dx, piece.box.y0 += dy, piece.box.y1 += dy;
}

/// Places pieces in rows from the top left, on new pages when full, and centres each page. Empty: a piece is too large.
std::vector<NetPage> packed(std::vector<Piece> pieces, double width, double height) {
  const double room_x = width - 2 * kPrinterMargin_mm, room_y = height - 2 * kPrinterMargin_mm - kNetFooter;
  std::vector<std::vector<Piece>> pages(1);
  double x = 0, y = 0, row = 0;
  for (Piece& piece : pieces) {
    const double wide = piece.box.width(), high = piece.box.height();
    if (wide > room_x || high > room_y) return {};
    if (x > 0 && x + wide > room_x) x = 0, y += row + kGap, row = 0;
    if (y > 0 && y + high > room_y) pages.emplace_back(), x = y = row = 0;
    move(piece, x - piece.box.x0, y - piece.box.y0);
    x += wide + kGap, row = std::max(row, high);
    pages.back().push_back(std::move(piece));
  }
  std::vector<NetPage> out;
  for (std::vector<Piece>& page : pages) {
    Box box;
    for (const Piece& piece : page) box.hold({{piece.box.x0, piece.box.y0}, {piece.box.x1, piece.box.y1}});
    NetPage sheet;
    sheet.width = width, sheet.height = height, sheet.landscape = width > height;
    for (Piece& piece : page) {
      move(piece, kPrinterMargin_mm + (room_x - box.width()) / 2 - box.x0,
           kPrinterMargin_mm + (room_y - box.height()) / 2 - box.y0);
      sheet.faces.insert(sheet.faces.end(), piece.faces.begin(), piece.faces.end());
      sheet.folds.insert(sheet.folds.end(), piece.folds.begin(), piece.folds.end());
      sheet.tabs.insert(sheet.tabs.end(), piece.tabs.begin(), piece.tabs.end());
      sheet.cuts.insert(sheet.cuts.end(), piece.cuts.begin(), piece.cuts.end());
    }
    out.push_back(std::move(sheet));
  }
  return out;
}

/// nullopt if it does not fit.
std::optional<Net> fitted(const MarkerBody& body, const Paper& paper) {
  const std::vector<SharedEdge> edges = shared_edges(body);
  const Unfolding unfolding(body, edges);
  // Axis-parallel orientations are tried first.
  std::vector<int> turns_deg = {0, 90};
  for (int turn = 6; turn < 180; turn += 6)
    if (turn != 90) turns_deg.push_back(turn);
  for (const std::vector<Group>& groups : ways(body.faces.size())) {
    std::optional<Net> best;
    for (const int turn : turns_deg) {
      const auto pieces = unfolding.pieces(groups, turn * std::numbers::pi / 180);
      if (!pieces) continue;
      for (const bool landscape : {false, true}) {
        Net net{packed(*pieces, landscape ? paper.height_mm : paper.width_mm,
                       landscape ? paper.width_mm : paper.height_mm)};
        if (!net.pages.empty() && (!best || net.pages.size() < best->pages.size())) best = std::move(net);
      }
    }
    if (best) return best;
  }
  return std::nullopt;
}

MarkerBody scaled(MarkerBody body, double by) {
  for (MarkerFace& face : body.faces) {
    face.body_face.translation = face.body_face.translation * by;
    for (FacePoint& p : face.outline) p.x *= by, p.y *= by;
  }
  return body;
}

}  // namespace

PagePoint NetFace::on_sheet(FacePoint p) const {
  const double c = std::cos(turn_rad), s = std::sin(turn_rad);
  return {center.x + kMm * (c * p.x - s * p.y), center.y - kMm * (s * p.x + c * p.y)};
}

std::vector<SharedEdge> shared_edges(const MarkerBody& body) {
  const auto point = [&](std::size_t face, std::size_t i) {
    const MarkerFace& f = body.faces[face];
    const FacePoint& p = f.outline[i % f.outline.size()];
    return transformed(f.body_face, Vec3d{p.x, p.y, 0});
  };
  const auto same = [](Vec3d p, Vec3d q) { return length(p - q) < 1e-6; };
  std::vector<SharedEdge> out;
  for (std::size_t a = 0; a < body.faces.size(); ++a)
    for (std::size_t b = a + 1; b < body.faces.size(); ++b)
      for (std::size_t i = 0; i < body.faces[a].outline.size(); ++i)
        for (std::size_t j = 0; j < body.faces[b].outline.size(); ++j)
          if (same(point(a, i), point(b, j + 1)) && same(point(a, i + 1), point(b, j))) out.push_back({a, i, b, j});
  return out;
}

double largest_scale(const MarkerBody& body, const Paper& paper) {
  double fits = 0, too_large = 1;
  while (fitted(scaled(body, too_large), paper) && too_large < 1e3) fits = too_large, too_large *= 2;
  while (too_large - fits > 1e-3 * too_large && too_large > 1e-6)
    (fitted(scaled(body, (fits + too_large) / 2), paper) ? fits : too_large) = (fits + too_large) / 2;
  return fits;
}

Result<Net> make_net(const MarkerBody& body, const Paper& paper) {
  std::optional<Net> net = fitted(body, paper);
  if (net) return *std::move(net);
  return invalid_argument("a face does not fit " + std::string(paper.name));
}

}  // namespace lightwell::calibrate
