// The net of a marker body: complete, without overlaps, and folded it gives the body.
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/tools/marker_sheets.hpp"

namespace lightwell::calibrate {
namespace {

using test::marker_body;
using Outline = std::vector<PagePoint>;

struct Case {
  std::string solid;
  double size_m;
  std::size_t paper;  ///< Index of kPapers.
  std::size_t pages;
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << c.solid << " " << 1000 * c.size_m << " mm " << kPapers[c.paper].name;
}

double dihedral(const std::string& solid) {
  if (solid == "cube") return std::numbers::pi / 2;
  return solid == "icosahedron" ? std::acos(-std::sqrt(5.0) / 3) : std::acos(-1 / std::sqrt(5.0));
}

double distance(PagePoint p, PagePoint q) { return std::hypot(p.x - q.x, p.y - q.y); }

class Nets : public testing::TestWithParam<Case> {
 protected:
  void SetUp() override {
    body_ = marker_body(GetParam().solid, GetParam().size_m);
    const auto net = make_net(body_, kPapers[GetParam().paper]);
    ASSERT_TRUE(net.ok()) << net.status().message();
    net_ = *net;
    ASSERT_EQ(net_.pages.size(), GetParam().pages);
  }

  [[nodiscard]] Outline outline(const NetFace& placed) const {
    Outline out;
    for (const FacePoint& p : body_.faces[placed.face].outline) out.push_back(placed.on_sheet(p));
    return out;
  }

  [[nodiscard]] static const NetFace& find(const NetPage& page, std::size_t face) {
    return *std::find_if(page.faces.begin(), page.faces.end(), [&](const NetFace& f) { return f.face == face; });
  }

  /// Whether an outline has this edge, in either direction.
  static bool has_edge(const Outline& o, PagePoint p, PagePoint q) {
    for (std::size_t i = 0; i < o.size(); ++i) {
      const PagePoint a = o[i], b = o[(i + 1) % o.size()];
      if (distance(a, p) + distance(b, q) < 1e-6 || distance(a, q) + distance(b, p) < 1e-6) return true;
    }
    return false;
  }

  MarkerBody body_;
  Net net_;
};

INSTANTIATE_TEST_SUITE_P(Bodies, Nets,
                         testing::Values(Case{"dodecahedron", 0.1, 0, 2}, Case{"dodecahedron", 0.1, 2, 2},
                                         Case{"dodecahedron", 0.1, 1, 1}, Case{"dodecahedron", 0.17, 0, 6},
                                         Case{"cube", 0.06, 0, 1}, Case{"cube", 0.08, 0, 2}, Case{"cube", 0.1, 1, 1},
                                         Case{"icosahedron", 0.1, 0, 2}, Case{"icosahedron", 0.06, 2, 1}));

TEST_P(Nets, HasEveryFaceOnce) {
  std::multiset<std::size_t> faces;
  for (const NetPage& page : net_.pages)
    for (const NetFace& f : page.faces) faces.insert(f.face);
  EXPECT_EQ(faces.size(), body_.faces.size());
  for (std::size_t i = 0; i < body_.faces.size(); ++i) EXPECT_EQ(faces.count(i), 1U);
}

TEST_P(Nets, EveryEdgeIsAFoldOrHasOneTab) {
  std::multiset<std::set<std::size_t>> joined;
  std::size_t sides = 0, drawn = 0;
  for (const NetPage& page : net_.pages) {
    for (const NetFold& fold : page.folds) joined.insert({fold.a, fold.b}), drawn += 2;
    for (const NetTab& tab : page.tabs) joined.insert({tab.on, tab.under}), ++drawn;
    drawn += page.cuts.size();
  }
  for (const MarkerFace& face : body_.faces) sides += face.outline.size();
  EXPECT_EQ(joined.size(), sides / 2);
  EXPECT_EQ(std::set<std::set<std::size_t>>(joined.begin(), joined.end()).size(), joined.size())
      << "no pair of faces is joined twice";
  EXPECT_EQ(drawn, sides) << "each side of each face is folded, has a tab or is cut";
}

TEST_P(Nets, FoldsAndTabsCoincideWithEdgesOfTheirFaces) {
  for (const NetPage& page : net_.pages) {
    for (const NetFold& fold : page.folds)
      for (const std::size_t face : {fold.a, fold.b})
        EXPECT_TRUE(has_edge(outline(find(page, face)), fold.from, fold.to)) << fold.a << " and " << fold.b;
    for (const NetTab& tab : page.tabs)
      EXPECT_TRUE(has_edge(outline(find(page, tab.on)), tab.outline.front(), tab.outline.back())) << tab.on;
    for (const auto& cut : page.cuts)
      EXPECT_TRUE(std::any_of(page.faces.begin(), page.faces.end(),
                              [&](const NetFace& f) { return has_edge(outline(f), cut[0], cut[1]); }));
  }
}

double area(const Outline& o) {
  double twice = 0;
  for (std::size_t i = 0; i < o.size(); ++i) {
    const PagePoint p = o[i], q = o[(i + 1) % o.size()];
    twice += p.x * q.y - q.x * p.y;
  }
  return std::abs(twice) / 2;
}

/// Area of the intersection of two convex outlines: p clipped by each side of q (Sutherland & Hodgman 1974).
double common_area(Outline p, const Outline& q) {
  PagePoint middle;
  for (const PagePoint& v : q)
    middle.x += v.x / static_cast<double>(q.size()), middle.y += v.y / static_cast<double>(q.size());
  for (std::size_t i = 0; i < q.size(); ++i) {
    const PagePoint a = q[i], b = q[(i + 1) % q.size()];
    const auto side = [&](PagePoint v) { return (b.x - a.x) * (v.y - a.y) - (b.y - a.y) * (v.x - a.x); };
    const double inwards = side(middle) > 0 ? 1 : -1;
    Outline left;
    for (std::size_t k = 0; k < p.size(); ++k) {
      const PagePoint u = p[k], v = p[(k + 1) % p.size()];
      const double of_u = inwards * side(u), of_v = inwards * side(v);
      if (of_u >= 0) left.push_back(u);
      if ((of_u > 0 && of_v < 0) || (of_u < 0 && of_v > 0)) {
        const double t = of_u / (of_u - of_v);
        left.push_back({u.x + t * (v.x - u.x), u.y + t * (v.y - u.y)});
      }
    }
    p = std::move(left);
  }
  return area(p);
}

TEST(CommonArea, IsRight) {
  const Outline square = {{0, 0}, {4, 0}, {4, 4}, {0, 4}};
  EXPECT_NEAR(common_area(square, {{3, 3}, {5, 3}, {5, 5}, {3, 5}}), 1, 1e-12);
  EXPECT_EQ(common_area(square, {{4, 0}, {8, 0}, {8, 4}}), 0);
}

TEST_P(Nets, NothingOverlapsAndAllIsWithinThePrintableArea) {
  for (const NetPage& page : net_.pages) {
    EXPECT_EQ(page.landscape, page.width > page.height);
    EXPECT_EQ(std::max(page.width, page.height), kPapers[GetParam().paper].height_mm);
    std::vector<Outline> all;
    for (const NetFace& f : page.faces) all.push_back(outline(f));
    for (const NetTab& t : page.tabs) all.push_back(t.outline);
    for (std::size_t i = 0; i < all.size(); ++i) {
      EXPECT_GT(area(all[i]), 20) << "mm2: tabs are large enough to be glued";
      for (std::size_t k = 0; k < i; ++k) EXPECT_LT(common_area(all[i], all[k]), 1e-3) << i << " and " << k;
      for (const PagePoint& p : all[i]) {
        EXPECT_GE(std::min(p.x, page.width - p.x), kPrinterMargin_mm - 1e-9);
        EXPECT_GE(std::min(p.y, page.height - kNetFooter - p.y), kPrinterMargin_mm - 1e-9);
      }
    }
  }
}

/// Poses of the faces in space, computed by folding the net.
class Folded {
 public:
  Folded(const MarkerBody& body, const Net& net, double dihedral_rad)
      : body_(body), fold_rad_(std::numbers::pi - dihedral_rad) {
    for (const NetPage& page : net.pages)
      for (const NetFace& f : page.faces) on_sheet_[f.face] = f;
    // The first face has its pose from the body file; the others follow from it.
    const std::size_t first = net.pages[0].faces[0].face;
    pose_[first] = body.faces[first].body_face;
    for (bool more = true; more;) {
      more = false;
      for (const NetPage& page : net.pages) {
        for (const NetFold& f : page.folds) more = fold(f.a, f.b, f.from, f.to) || fold(f.b, f.a, f.from, f.to) || more;
        for (const NetTab& t : page.tabs) more = glue(t) || more;
      }
    }
  }

  [[nodiscard]] const std::map<std::size_t, Pose>& poses() const { return pose_; }

  /// A point of the sheet in a face's frame.
  [[nodiscard]] Vec3d in_face(std::size_t face, PagePoint p) const {
    const NetFace& f = on_sheet_.at(face);
    const double x = (p.x - f.center.x) / 1000, y = (f.center.y - p.y) / 1000;
    const double c = std::cos(f.turn_rad), s = std::sin(f.turn_rad);
    return {c * x + s * y, -s * x + c * y, 0};
  }

 private:
  /// Folds the child away from the print along the line p, q. `flat`: its pose in the parent's frame before folding.
  void bend(std::size_t parent, std::size_t child, Vec3d p, Vec3d q, const Pose& flat) {
    // With the parent to the left of the axis, a positive rotation moves the child on the right downwards.
    if (cross(q - p, -p).z < 0) std::swap(p, q);
    const Quat turn = Quat::about(normalized(q - p), fold_rad_);
    pose_[child] = compose(pose_[parent], compose(Pose{turn, p - rotate(turn, p)}, flat));
  }

  bool fold(std::size_t parent, std::size_t child, PagePoint from, PagePoint to) {
    if (!pose_.contains(parent) || pose_.contains(child)) return false;
    const Quat turn = Quat::about({0, 0, 1}, on_sheet_[child].turn_rad - on_sheet_[parent].turn_rad);
    bend(parent, child, in_face(parent, from), in_face(parent, to), {turn, in_face(parent, on_sheet_[child].center)});
    return true;
  }

  /// Joins the edge of the other face to that of the tab and folds. The body file gives the matching edge.
  bool glue(const NetTab& tab) {
    const bool on_known = pose_.contains(tab.on);
    if (on_known == pose_.contains(tab.under)) return false;
    const std::size_t parent = on_known ? tab.on : tab.under, child = on_known ? tab.under : tab.on;
    for (const SharedEdge& e : shared_edges(body_)) {
      if (!((e.a == parent && e.b == child) || (e.a == child && e.b == parent))) continue;
      const auto edge = [&](std::size_t face) {
        const FaceOutline& o = body_.faces[face].outline;
        const std::size_t i = face == e.a ? e.edge_a : e.edge_b;
        const FacePoint p = o[i], q = o[(i + 1) % o.size()];
        return std::pair<Vec3d, Vec3d>{{p.x, p.y, 0}, {q.x, q.y, 0}};
      };
      const auto [p, q] = edge(parent);
      const auto [r, s] = edge(child);
      const Quat turn = Quat::about({0, 0, 1}, std::atan2(p.y - q.y, p.x - q.x) - std::atan2(s.y - r.y, s.x - r.x));
      bend(parent, child, p, q, {turn, q - rotate(turn, r)});
      return true;
    }
    return false;
  }

  const MarkerBody& body_;
  double fold_rad_;
  std::map<std::size_t, NetFace> on_sheet_;
  std::map<std::size_t, Pose> pose_;
};

TEST_P(Nets, FoldedByTheDihedralAngleTheNetIsTheBody) {
  const Folded folded(body_, net_, dihedral(GetParam().solid));
  ASSERT_EQ(folded.poses().size(), body_.faces.size());
  for (const auto& [face, pose] : folded.poses()) {
    const Pose& wanted = body_.faces[face].body_face;
    EXPECT_LT(length(pose.translation - wanted.translation), 1e-9) << face;
    for (const Vec3d axis : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}})
      EXPECT_LT(length(rotate(pose.rotation, axis) - rotate(wanted.rotation, axis)), 1e-9) << face;
  }
}

TEST_P(Nets, EveryTabLiesBeneathTheFaceItNames) {
  const Folded folded(body_, net_, dihedral(GetParam().solid));
  for (const NetPage& page : net_.pages)
    for (const NetTab& tab : page.tabs) {
      const Vec3d from = transformed(folded.poses().at(tab.on), folded.in_face(tab.on, tab.outline.front()));
      const Vec3d to = transformed(folded.poses().at(tab.on), folded.in_face(tab.on, tab.outline.back()));
      const FaceOutline& o = body_.faces[tab.under].outline;
      const auto corner = [&](std::size_t i) {
        return transformed(folded.poses().at(tab.under), Vec3d{o[i % o.size()].x, o[i % o.size()].y, 0});
      };
      double nearest = 1;
      for (std::size_t i = 0; i < o.size(); ++i)
        nearest = std::min(nearest, length(corner(i) - to) + length(corner(i + 1) - from));
      EXPECT_LT(nearest, 1e-9) << tab.on << " beneath " << tab.under;
    }
}

TEST(MarkerNet, TheDodecahedronHasTwoPieces) {
  const auto net = make_net(marker_body("dodecahedron", 0.1), kPapers[0]);
  for (std::size_t page = 0; page < 2; ++page) {
    EXPECT_EQ(net->pages[page].folds.size(), 5U);
    for (const NetFold& fold : net->pages[page].folds) EXPECT_EQ(fold.a, page == 0 ? 0U : 11U);
  }
}

TEST(MarkerNet, LargestScaleIsTight) {
  for (const std::string solid : {"dodecahedron", "cube", "icosahedron"}) {
    const MarkerBody body = marker_body(solid, 0.1);
    const double scale = largest_scale(body, kPapers[0]);
    EXPECT_GT(scale, 1);
    EXPECT_TRUE(make_net(marker_body(solid, 0.1 * scale), kPapers[0]).ok()) << solid;
    EXPECT_FALSE(make_net(marker_body(solid, 0.1 * scale * 1.003), kPapers[0]).ok()) << solid;
  }
}

TEST(MarkerNet, AcceptsABodyThatIsNoRegularSolid) {
  // A cube without its bottom.
  MarkerBody box = marker_body("cube", 0.06);
  box.faces.pop_back();
  const auto net = make_net(box, kPapers[0]);
  ASSERT_TRUE(net.ok());
  std::size_t faces = 0;
  for (const NetPage& page : net->pages) faces += page.faces.size();
  EXPECT_EQ(faces, 5U);
}

}  // namespace
}  // namespace lightwell::calibrate
