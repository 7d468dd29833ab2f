#include "reference/shadow_tracer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "reference/quadrature.hpp"

namespace lightwell::reference {
namespace {

constexpr std::size_t leaf_size = 4;

double component(const V3& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

V3 least(const V3& a, const V3& b) { return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)}; }
V3 greatest(const V3& a, const V3& b) { return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)}; }

/// Two vectors that form an orthonormal frame with n.
std::array<V3, 2> frame_of(const V3& n) {
  const V3 helper = std::abs(n.z) < 0.9 ? V3{0, 0, 1} : V3{1, 0, 0};
  const V3 u = normalised(cross(helper, n));
  return {u, cross(n, u)};
}

/// Uniform in solid angle over the cap.
V3 in_cap(const V3& axis, double radius, double a, double b) {
  const double cosine = 1 - a * (1 - std::cos(radius)), sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
  const auto [u, v] = frame_of(axis);
  return cosine * axis + (sine * std::cos(2 * pi * b)) * u + (sine * std::sin(2 * pi * b)) * v;
}

}  // namespace

ShadowTracer::ShadowTracer(ShadowScene scene) : scene_(std::move(scene)) {
  for (std::size_t t = 0; t < scene_.mesh.triangles.size(); ++t) order_.push_back(t);
  if (!order_.empty()) (void)build(0, order_.size());
}

V3 ShadowTracer::corner(std::size_t triangle, std::size_t k) const {
  return scene_.mesh.positions[scene_.mesh.triangles[triangle][k]];
}

std::size_t ShadowTracer::build(std::size_t first, std::size_t count) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  Node node{{inf, inf, inf}, {-inf, -inf, -inf}};
  for (std::size_t i = first; i < first + count; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      node.low = least(node.low, corner(order_[i], k));
      node.high = greatest(node.high, corner(order_[i], k));
    }
  }
  const std::size_t index = nodes_.size();
  nodes_.push_back(node);
  if (count <= leaf_size) {
    nodes_[index].first = first;
    nodes_[index].count = count;
    return index;
  }
  const V3 size = node.high - node.low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const auto middle_of = [&](std::size_t t) {
    return component(corner(t, 0), axis) + component(corner(t, 1), axis) + component(corner(t, 2), axis);
  };
  const auto begin = order_.begin() + static_cast<std::ptrdiff_t>(first);
  std::nth_element(begin, begin + static_cast<std::ptrdiff_t>(count / 2), begin + static_cast<std::ptrdiff_t>(count),
                   [&](std::size_t a, std::size_t b) { return middle_of(a) < middle_of(b); });
  const std::size_t left = build(first, count / 2);
  const std::size_t right = build(first + count / 2, count - count / 2);
  nodes_[index].left = left;
  nodes_[index].right = right;
  return index;
}

std::optional<RayHit> ShadowTracer::intersection(std::size_t triangle, V3 origin, V3 direction) const {
  // Moeller & Trumbore 1997.
  const V3 a = corner(triangle, 0), e = corner(triangle, 1) - a, f = corner(triangle, 2) - a;
  const V3 p = cross(direction, f);
  const double determinant = dot(e, p);
  if (determinant == 0) return {};
  const V3 s = origin - a;
  const double u = dot(s, p) / determinant;
  if (!(u >= 0 && u <= 1)) return {};
  const V3 q = cross(s, e);
  const double v = dot(direction, q) / determinant;
  if (!(v >= 0 && u + v <= 1)) return {};
  const double t = dot(f, q) / determinant;
  if (!(t > 1e-12)) return {};
  return RayHit{t, triangle, u, v};
}

bool ShadowTracer::hits_by_brute_force(V3 origin, V3 direction, double limit) const {
  for (std::size_t t = 0; t < scene_.mesh.triangles.size(); ++t) {
    const auto hit = intersection(t, origin, direction);
    if (hit && hit->distance < limit) return true;
  }
  return false;
}

template <class Visit>
void ShadowTracer::traverse(V3 origin, V3 direction, Visit& visit) const {
  if (nodes_.empty()) return;
  std::array<std::size_t, 128> stack{};
  std::size_t waiting = 1;
  while (waiting > 0) {
    const Node& node = nodes_[stack[--waiting]];
    double near = 0, far = visit.limit;
    for (int axis = 0; axis < 3; ++axis) {
      const double o = component(origin, axis), d = component(direction, axis);
      const double low = component(node.low, axis) - 1e-9, high = component(node.high, axis) + 1e-9;
      if (d == 0) {
        if (o < low || o > high) far = -1;
        continue;
      }
      const double a = (low - o) / d, b = (high - o) / d;
      near = std::max(near, std::min(a, b));
      far = std::min(far, std::max(a, b));
    }
    if (near > far) continue;
    if (node.count == 0) {
      stack[waiting++] = node.left;
      stack[waiting++] = node.right;
      continue;
    }
    for (std::size_t i = node.first; i < node.first + node.count; ++i)
      if (visit(order_[i])) return;
  }
}

bool ShadowTracer::hits(V3 origin, V3 direction, double limit) const {
  struct {
    const ShadowTracer* tracer;
    V3 origin, direction;
    double limit;
    bool found = false;
    bool operator()(std::size_t triangle) {
      const auto hit = tracer->intersection(triangle, origin, direction);
      return found = hit && hit->distance < limit;
    }
  } any{this, origin, direction, limit};
  traverse(origin, direction, any);
  return any.found;
}

std::optional<RayHit> ShadowTracer::nearest_hit(V3 origin, V3 direction) const {
  struct {
    const ShadowTracer* tracer;
    V3 origin, direction;
    double limit = std::numeric_limits<double>::infinity();
    std::optional<RayHit> found;
    bool operator()(std::size_t triangle) {
      const auto hit = tracer->intersection(triangle, origin, direction);
      if (hit && hit->distance < limit) {
        found = hit;
        limit = hit->distance;
      }
      return false;
    }
  } nearest{this, origin, direction};
  traverse(origin, direction, nearest);
  return nearest.found;
}

Rgb ShadowTracer::ratio(const PlaneRectangle& rectangle, int rays) const {
  Rgb with{}, without{};
  RectanglePoints points(rectangle);
  const auto add = [&](V3 at, V3 direction, double limit, const Rgb& weighted_radiance) {
    if (direction.z <= 0) return;
    const bool free = !hits(at, direction, limit);
    for (std::size_t c = 0; c < 3; ++c) {
      const double e = weighted_radiance[c] * direction.z / rays;
      without[c] += e;
      if (free) with[c] += e;
    }
  };
  const auto times = [](double k, const Rgb& c) { return Rgb{k * c[0], k * c[1], k * c[2]}; };
  constexpr double inf = std::numeric_limits<double>::infinity();
  for (const ShadowLight& light : scene_.lights) {
    const V3 axis = normalised(light.direction);
    const double sine = std::sin(light.radius_rad);
    points.next_set(rays, [&](V3 at, double a, double b) {
      // E at normal incidence is pi sin² L, the cap's solid angle 2 pi (1 - cos): L dw of one ray is their ratio.
      if (light.distance == 0) {
        const double k = light.radius_rad > 0 ? 2 * (1 - std::cos(light.radius_rad)) / (sine * sine) : 1.0;
        return add(at, in_cap(axis, light.radius_rad, a, b), inf, times(k, light.irradiance));
      }
      const V3 to_lamp = light.distance * axis - at;
      const double far = length(to_lamp);
      const double radius = std::asin(std::min(1.0, light.distance * sine / far));
      const double k = radius > 0 ? 2 * (1 - std::cos(radius)) / (sine * sine) : std::pow(light.distance / far, 2);
      add(at, in_cap(normalised(to_lamp), radius, a, b), far, times(k, light.irradiance));
    });
  }
  if (scene_.residual) {
    points.next_set(rays, [&](V3 at, double a, double b) {
      // Density cos / pi.
      const double r = std::sqrt(a), z = std::sqrt(1 - a);
      const V3 d{r * std::cos(2 * pi * b), r * std::sin(2 * pi * b), z};
      if (z > 0) add(at, d, inf, times(pi / z, scene_.residual(d)));
    });
  }
  Rgb out{1, 1, 1};
  for (std::size_t c = 0; c < 3; ++c)
    if (without[c] > 0) out[c] = with[c] / without[c];
  return out;
}

TriangleMesh joined(TriangleMesh a, const TriangleMesh& b) {
  const auto first = static_cast<std::uint32_t>(a.positions.size());
  a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
  for (const auto& [i, j, k] : b.triangles) a.triangles.push_back({first + i, first + j, first + k});
  return a;
}

namespace {

/// A grid of (columns + 1) x (rows + 1) vertices; two triangles for each square.
template <class Position>
TriangleMesh make_grid(int columns, int rows, const Position& position) {
  TriangleMesh out;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i <= columns; ++i) out.positions.push_back(position(i, j));
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(j * (columns + 1) + i); };
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      out.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      out.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return out;
}

}  // namespace

TriangleMesh make_blob(V3 centre, double radius, double bumps, int rings, int segments) {
  TriangleMesh out = make_grid(segments, rings, [&](int i, int j) {
    const double polar = pi * j / rings, azimuth = 2 * pi * (i % segments) / segments;
    const double ring = j == 0 || j == rings ? 0.0 : std::sin(polar);
    const V3 d{ring * std::cos(azimuth), ring * std::sin(azimuth), std::cos(polar)};
    return centre + radius * (1 + bumps * std::sin(5 * d.x + 1) * std::sin(4 * d.y + 2) * std::sin(6 * d.z)) * d;
  });
  // At the poles one triangle of each square has no area.
  std::erase_if(out.triangles, [&](const auto& t) {
    const auto pole = [&](std::uint32_t v) {
      const int j = static_cast<int>(v) / (segments + 1);
      return j == 0 ? 1 : j == rings ? 2 : 0;
    };
    const auto both = [&](std::size_t a, std::size_t b) { return pole(t[a]) != 0 && pole(t[a]) == pole(t[b]); };
    return both(0, 1) || both(1, 2) || both(2, 0);
  });
  // Outwards.
  for (auto& t : out.triangles) std::swap(t[1], t[2]);
  return out;
}

TriangleMesh make_box(V3 low, V3 high, int n) {
  TriangleMesh out;
  const V3 size = high - low;
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2;
    const bool upper = face % 2 != 0;
    out = joined(std::move(out), make_grid(n, n, [&](int i, int j) {
                   // i and j exchanged on the lower side: all faces look outwards.
                   const double a = double(upper ? i : j) / n, b = double(upper ? j : i) / n, c = upper ? 1 : 0;
                   const V3 k = axis == 0 ? V3{c, a, b} : axis == 1 ? V3{b, c, a} : V3{a, b, c};
                   return V3{low.x + k.x * size.x, low.y + k.y * size.y, low.z + k.z * size.z};
                 }));
  }
  return out;
}

TriangleMesh make_pole(V3 foot, V3 head, double radius, int n, int m) {
  const auto [u, v] = frame_of(normalised(head - foot));
  return make_grid(n, m, [&, u = u, v = v](int i, int j) {
    const double azimuth = 2 * pi * (i % n) / n;
    return foot + (double(j) / m) * (head - foot) + (radius * std::cos(azimuth)) * u + (radius * std::sin(azimuth)) * v;
  });
}

TriangleMesh make_chair(V3 position, double width, double turn_rad, int n) {
  const double w = width / 2, leg = 0.1 * width;
  TriangleMesh out;
  for (const double x : {-w, w - leg})
    for (const double y : {-w, w - leg})
      out = joined(std::move(out), make_box({x, y, 0}, {x + leg, y + leg, width}, n));
  out = joined(std::move(out), make_box({-w, -w, width}, {w, w, width + leg}, n));
  out = joined(std::move(out), make_box({-w, w - leg, width + leg}, {w, w, 2 * width}, n));
  for (V3& p : out.positions)
    p = position + V3{std::cos(turn_rad) * p.x - std::sin(turn_rad) * p.y,
                      std::sin(turn_rad) * p.x + std::cos(turn_rad) * p.y, p.z};
  return out;
}

}  // namespace lightwell::reference
