// Camera models in OpenCV's axes: x right, y down, z forward.
#pragma once

#include <optional>

#include "reference/vector.hpp"

namespace lightwell::reference {

// All `project` take a point (any length, camera's frame, _cv) and return its image in pixels, none
// where the model has no valid image of it. All `unproject` take pixels and return the unit
// direction (_cv), none where no valid direction has that image. Whole pixel numbers are pixel
// centres. Image borders are not checked. The radial models are unprojected by bisection of their
// radius function until two neighbouring doubles bracket the root.

/// Kannala & Brandt (2006), eq. 6, in the form and parameter order of OpenCV's fisheye module:
/// theta = atan2(hypot(x, y), z), right beyond 90 degrees;
/// r = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8);
/// pixel = (fx r x / hypot(x, y) + cx, fy r y / hypot(x, y) + cy). Focal lengths in pixels per rad.
/// Valid up to the first theta where r stops growing, or pi.
struct KannalaBrandt {
  double fx = 1, fy = 1, cx = 0, cy = 0;
  double k1 = 0, k2 = 0, k3 = 0, k4 = 0;
};

/// r(theta), theta in rad.
double radius(const KannalaBrandt& camera, double theta);
/// The largest valid theta, in rad: the first zero of dr/dtheta in (0, pi), or pi.
double largest_theta(const KannalaBrandt& camera);
std::optional<V2> project(const KannalaBrandt& camera, const V3& point_cv);
std::optional<V3> unproject(const KannalaBrandt& camera, const V2& pixel);

/// Usenko, Demmel & Cremers, "The double sphere camera model" (2018): eq. 40-42 for the projection,
/// 43-45 for its domain z > -w2 d1. -1 < xi < 1, 0 <= alpha <= 1.
///
/// The paper's w2 places the limit on the second sphere at d2 = 1, but the model has d1 = 1. For
/// xi = 0 both are the same; otherwise the domain ends a few degrees before the model stops being
/// one-to-one. `project` uses the paper's domain; `unproject` goes to the true end, as the paper's own
/// condition r^2 <= 1 / (2 alpha - 1) for alpha > 1/2 does. Between largest_theta and turning_theta a
/// pixel has a direction that `project` rejects.
struct DoubleSphere {
  double fx = 1, fy = 1, cx = 0, cy = 0;
  double xi = 0, alpha = 0;
};

/// The distance from the centre in the plane before fx and fy, of a direction theta (rad) from the
/// axis; infinity where the denominator is not positive.
double radius(const DoubleSphere& camera, double theta);
/// The end of the paper's domain (exclusive), acos(-w2), in rad.
double largest_theta(const DoubleSphere& camera);
/// Where the radius stops growing (alpha > 1/2) or becomes infinite, in rad: the direction whose
/// angle psi on the second sphere has cos psi = -w1, with cos psi = (xi + cos theta) /
/// sqrt(1 + 2 xi cos theta + xi^2), solved for cos theta.
double turning_theta(const DoubleSphere& camera);
std::optional<V2> project(const DoubleSphere& camera, const V3& point_cv);
std::optional<V3> unproject(const DoubleSphere& camera, const V2& pixel);

/// The equirectangular mapping of proto/README.md in OpenCV's axes (x, -y, -z of the probe's): the
/// centre of the image is +z, right is +x, the top row is -y. Pixels x in [-0.5, W - 0.5], y in
/// [-0.5, H - 0.5].
struct Equirectangular {
  int width = 0, height = 0;
};

std::optional<V2> project(const Equirectangular& camera, const V3& point_cv);
std::optional<V3> unproject(const Equirectangular& camera, const V2& pixel);

}  // namespace lightwell::reference
