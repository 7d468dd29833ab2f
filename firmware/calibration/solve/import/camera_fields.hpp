// Common parts of the formats: picture sizes, the camera matrix, and conversion of lens models.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>

#include <lightwell/calibration.hpp>

namespace lightwell {

/// Focal lengths and principal point, pixels; the centre of the top left pixel is (0, 0).
struct PinholeFields {
  double fx = 0, fy = 0, cx = 0, cy = 0;
};

/// Error text for an invalid picture size, pinhole or list of numbers; empty if valid.
[[nodiscard]] std::string size_problem(double width, double height);
[[nodiscard]] std::string pinhole_problem(const PinholeFields& p);
[[nodiscard]] std::string numbers_problem(std::span<const double> values);
/// Checks a 3x3 camera matrix (row-major): shape, skew, and pinhole_problem().
[[nodiscard]] std::string camera_matrix_problem(std::span<const double> k);
/// The fields of a camera matrix (row-major) that passes camera_matrix_problem().
[[nodiscard]] PinholeFields pinhole_of(std::span<const double> k);

/// From four coefficients k1 k2 k3 k4; the order is the same in all three formats.
[[nodiscard]] KannalaBrandtParameters kannala_brandt_of(const PinholeFields& p, std::span<const double> k);

/// The unified model (Geyer & Daniilidis 2000, Mei & Rives 2007) with OpenCV's distortion in its order k1 k2 p1 p2 k3
/// k4 ...; with xi = 0 it is a pinhole. Empty if no supported model is exactly equal.
[[nodiscard]] std::optional<ModelParameters> unified_lens(const PinholeFields& p, double xi, std::span<const double> d);

/// Error text for a lens model that has no exact equivalent here: the reason and the remedy.
[[nodiscard]] std::string no_exact_model(const std::string& model, const std::string& why);

/// "1, 2"
[[nodiscard]] std::string listed(std::span<const double> values);

}  // namespace lightwell
