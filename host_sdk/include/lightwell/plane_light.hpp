// The light that a captured plane reflects onto virtual objects.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <lightwell/captured_plane.hpp>
#include <lightwell/color.hpp>
#include <lightwell/geometry.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/plane_appearance.hpp>

namespace lightwell {

/// What the plane's part of an irradiance was computed from.
enum class PlaneLightSource : std::uint8_t {
  none,        ///< Nothing: the value is 0.
  texture,     ///< The captured texture and lumisphere.
  descriptor,  ///< The probe sends no texture: the lower hemisphere of the lighting, as if the plane were endless.
};

/// An irradiance. Its luminance is in lux if units are absolute; never NaN or negative.
struct PlaneLightAnswer {
  Irradiance value;
  /// The worse one of the plane's and, where it is used, of the lighting's. none: nothing was received, or the probe
  /// sends no texture and no lighting is given. invalid_query: an argument is not finite, the normal is zero, or the
  /// point is below the plane. For these two the value is 0.
  Validity validity = Validity::none;
  PlaneFlags flags;  ///< Of all texels together: unseen_texel, clipped_texel. Unseen texels count as the others' mean.
  PlaneLightSource source = PlaneLightSource::none;
};

/// Irradiance by a captured plane at points above it. Create it once, update it with each snapshot. Any number of
/// threads may query it while none updates it. Queries do not allocate.
///
/// Method. D is a quadtree of mean radiances. A query sums tiles whose radiance varies little for the point, each with
/// Lambert's closed form of the irradiance by a uniform polygon, clipped at the receiver's horizon (Arvo 1994, "The
/// Irradiance Jacobian for Partially Occluded Polyhedral Sources", section 2). S arrives as 545 beams,
/// means over cells of the hemisphere, each with the part of it that leaves the square towards the point.
class PlaneLight {
 public:
  /// Allocates only if the texture is larger than before. About 10 ms for 256 x 256 texels if the plane has changed,
  /// otherwise microseconds.
  void update(const PlaneAppearance& plane);

  /// Irradiance at `point` (m, plane's frame, z at least 0) of a surface that faces `normal`, which need not be
  /// normalised, by what leaves the captured square: D, S, or both. Nothing but the plane hides parts of it; light that
  /// a virtual object takes from the plane (ShadowCaster) is not subtracted. About 13 us.
  [[nodiscard]] PlaneLightAnswer irradiance(Vec3d point, Vec3d normal, PlaneLayers layers = PlaneLayers::all) const;

  /// The whole irradiance: that of the lighting, in which the directions that the square covers as seen from the point
  /// have the light of the square (D + S) instead of the lighting's. The lighting's axes are those of the plane:
  /// lighting.rotated(T_plane_lighting.rotation). Without a texture it is the lighting's irradiance alone, and `source`
  /// is descriptor. About 20 us; more at the first query of a lighting (Lighting::radiance).
  [[nodiscard]] PlaneLightAnswer irradiance(Vec3d point, Vec3d normal, const Lighting& lighting) const;

 private:
  struct Tile {
    Radiance mean;
    float range = 0;  ///< Largest difference of a channel between two texels.
  };
  struct Level {
    int edge = 0;           ///< Tiles along a side, each of 2^level texels; the last ones may be cut off.
    std::size_t first = 0;  ///< Index of the first tile, which is at the top left.
  };
  /// A cell of directions from the plane to a viewer.
  struct Beam {
    Vec3f direction;   ///< Mean, weighted by the radiance.
    float radius = 0;  ///< Of a cap with the same solid angle, rad.
    Radiance flux;     ///< Radiance times solid angle.
  };
  struct Receiver;

  void build_tiles(const PlaneAppearance& plane);
  void build_beams(const PlaneAppearance& plane);
  [[nodiscard]] Validity check(Vec3d point, Vec3d normal) const;
  [[nodiscard]] Receiver place(Vec3d point, Vec3d normal) const;
  [[nodiscard]] Irradiance diffuse(const Receiver& receiver) const;
  [[nodiscard]] Irradiance specular(const Receiver& receiver) const;
  [[nodiscard]] Irradiance covered(const Receiver& receiver, const Lighting& lighting) const;

  Validity validity_ = Validity::none;
  PlaneFlags flags_;
  PlaneInfo info_;
  std::uint64_t revision_ = 0;
  std::size_t missing_ = 0;
  int edge_ = 0;
  std::vector<Tile> tiles_;
  std::vector<Level> levels_;
  std::vector<Beam> beams_;
};

}  // namespace lightwell
