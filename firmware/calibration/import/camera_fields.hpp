// What the formats have in common: sizes, the camera matrix, and lenses below 180 degrees.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>

#include <lightwell/calibration.hpp>

namespace lightwell {

/// Focal lengths and principal point, pixels; the centre of the top left one is (0, 0).
struct PinholeFields {
  double fx = 0, fy = 0, cx = 0, cy = 0;
};

/// What is wrong with a picture's size, a pinhole, a list of numbers; empty where nothing is.
[[nodiscard]] std::string size_problem(double width, double height);
[[nodiscard]] std::string pinhole_problem(const PinholeFields& p);
[[nodiscard]] std::string numbers_problem(std::span<const double> values);
/// Of a 3x3 camera matrix, row by row: its shape, a skew, and what pinhole_problem() says.
[[nodiscard]] std::string camera_matrix_problem(std::span<const double> k);
/// Of a matrix without problem.
[[nodiscard]] PinholeFields pinhole_of(std::span<const double> k);

/// Of four coefficients k1 k2 k3 k4, which all three formats order alike.
[[nodiscard]] KannalaBrandtParameters kannala_brandt_of(const PinholeFields& p, std::span<const double> k);

/// The unified model (Geyer & Daniilidis 2000, Mei & Rives 2007) with OpenCV's distortion in its order k1 k2 p1 p2 k3
/// k4 ...; with xi = 0 it is a pinhole. Nothing where no model of ours is exactly that.
[[nodiscard]] std::optional<ModelParameters> unified_lens(const PinholeFields& p, double xi, std::span<const double> d);

/// Why a lens whose model we have not is refused, and what to do.
[[nodiscard]] std::string no_exact_model(const std::string& model, const std::string& why);

/// "1, 2"
[[nodiscard]] std::string listed(std::span<const double> values);

}  // namespace lightwell
