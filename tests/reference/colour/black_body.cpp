#include "reference/colour/black_body.hpp"

#include <cmath>
#include <cstdio>
#include <fstream>
#include <stdexcept>

namespace lightwell::reference {

Xy xy_of(Uv c) {
  const double d = 2 * c.u - 8 * c.v + 4;
  return {3 * c.u / d, 2 * c.v / d};
}

BlackBody::BlackBody(const std::string& file) {
  std::ifstream in(file);
  std::string line;
  int rows = 0;
  while (std::getline(in, line)) {
    if (line.starts_with('#')) continue;
    Row row{};
    if (rows == kRows || std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf", &row.metres, &row.x, &row.y, &row.z) != 4)
      throw std::runtime_error(file + ": not 471 rows of four numbers");
    row.metres *= 1e-9;
    rows_[rows++] = row;
  }
  if (rows != kRows) throw std::runtime_error(file + ": not 471 rows");
}

Uv BlackBody::uv(double kelvin) const {
  // Second radiation constant, m K (CIE 15:2004).
  constexpr double kC2 = 1.4388e-2;
  double x = 0, y = 0, z = 0;
  for (const Row& row : rows_) {
    const double power = std::pow(row.metres, -5) / (std::exp(kC2 / (row.metres * kelvin)) - 1);
    x += power * row.x;
    y += power * row.y;
    z += power * row.z;
  }
  const double d = x + 15 * y + 3 * z;
  return {4 * x / d, 6 * y / d};
}

Uv BlackBody::beside(double kelvin, double duv) const {
  constexpr double kStep = 1e-4;
  const Uv at = uv(kelvin), hotter = uv(kelvin * (1 + kStep)), colder = uv(kelvin * (1 - kStep));
  const double du = hotter.u - colder.u, dv = hotter.v - colder.v, length = std::hypot(du, dv);
  // Hotter is towards smaller u: the normal towards greater v is the tangent turned clockwise.
  return {at.u + duv * dv / length, at.v - duv * du / length};
}

double BlackBody::nearest_kelvin(Uv c) const {
  const auto distance = [&](double log_kelvin) {
    const Uv p = uv(std::exp(log_kelvin));
    return std::hypot(p.u - c.u, p.v - c.v);
  };
  // A coarse grid, then golden sections around its best point.
  const double low = std::log(900.0), high = std::log(110000.0);
  constexpr int kGrid = 50;
  int best = 0;
  for (int i = 1; i <= kGrid; ++i)
    if (distance(low + (high - low) * i / kGrid) < distance(low + (high - low) * best / kGrid)) best = i;
  double a = low + (high - low) * (best - 1) / kGrid, b = low + (high - low) * (best + 1) / kGrid;
  const double golden = (std::sqrt(5.0) - 1) / 2;
  while (b - a > 1e-8) {
    const double p = b - golden * (b - a), q = a + golden * (b - a);
    (distance(p) < distance(q) ? b : a) = distance(p) < distance(q) ? q : p;
  }
  return std::exp((a + b) / 2);
}

}  // namespace lightwell::reference
