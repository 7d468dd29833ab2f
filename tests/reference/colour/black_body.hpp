// Colours of black bodies and correlated colour temperatures, by integration of Planck's law. Double precision.
#pragma once

#include <string>

namespace lightwell::reference {

/// CIE 1960 u, v.
struct Uv {
  double u, v;
};

/// CIE 1931 x, y of u, v.
struct Xy {
  double x, y;
};
Xy xy_of(Uv c);

/// With the colour matching functions of `file` (cie1931.csv), summed at every nanometre (CIE 15:2004, 7.1).
class BlackBody {
 public:
  explicit BlackBody(const std::string& file);

  /// Chromaticity of a black body.
  [[nodiscard]] Uv uv(double kelvin) const;
  /// The chromaticity at a signed distance from the locus, along its normal at this temperature.
  [[nodiscard]] Uv beside(double kelvin, double duv) const;
  /// The temperature of the nearest point of the locus, from 900 to 110,000 K, by a search without a table.
  [[nodiscard]] double nearest_kelvin(Uv c) const;

 private:
  struct Row {
    double metres, x, y, z;
  };
  static constexpr int kRows = 471;
  Row rows_[kRows];
};

}  // namespace lightwell::reference
