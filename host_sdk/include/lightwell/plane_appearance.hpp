// A glossy plane that a probe captured, as an application sees it: its radiance from any viewpoint.
//
//   PlaneReader reader;
//   reader.take(message, host_now);                         // each message of the probe
//   PlaneAppearance plane = reader.snapshot(host_now);      // immutable
//   plane.render(camera, PlaneLayers::all, rgb);            // in the render loop
//
// Points and directions are in the plane's frame (captured_plane.hpp). T_plane_world of a plane whose pose the
// application knows is inverse(T_world_plane).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <lightwell/captured_plane.hpp>
#include <lightwell/lighting.hpp>
#include <lightwell/plane_guidance.hpp>

namespace lightwell {

struct PlaneUpdate;

namespace core {
struct PlaneState;
}

/// Which parts of the radiance are wanted: D + S, or one of the two.
enum class PlaneLayers : std::uint8_t {
  all,
  diffuse,   ///< D alone: what is seen where a virtual object hides the mirror image of the room.
  specular,  ///< S alone.
};

/// Why a radiance may be wrong.
enum class PlaneFlag : std::uint8_t {
  unseen_direction = 0,   ///< No frame saw the plane from there; S is an extrapolation.
  clipped_direction = 1,  ///< S was saturated there: it is a lower bound.
  unseen_texel = 2,       ///< No frame saw one of the four texels; D is that of the others, or 0.
  clipped_texel = 3,      ///< One of the four texels was saturated: D is a lower bound.
};
inline constexpr std::array kPlaneFlags = {PlaneFlag::unseen_direction, PlaneFlag::clipped_direction,
                                           PlaneFlag::unseen_texel, PlaneFlag::clipped_texel};

/// A set of such flags; bit k stands for the flag k.
class PlaneFlags {
 public:
  constexpr void set(PlaneFlag f) { bits_ = static_cast<std::uint8_t>(bits_ | 1U << static_cast<unsigned>(f)); }
  [[nodiscard]] constexpr bool has(PlaneFlag f) const { return (bits_ >> static_cast<unsigned>(f) & 1U) != 0; }
  [[nodiscard]] constexpr bool any() const { return bits_ != 0; }
  [[nodiscard]] constexpr std::uint8_t bits() const { return bits_; }
  constexpr PlaneFlags& operator|=(PlaneFlags o) {
    bits_ = static_cast<std::uint8_t>(bits_ | o.bits_);
    return *this;
  }
  friend constexpr bool operator==(PlaneFlags, PlaneFlags) = default;

 private:
  std::uint8_t bits_ = 0;
};

/// A radiance of the plane. `validity`: none, with value 0, if nothing was received, if a tile that it needs has not
/// arrived yet, or if D is wanted and the probe sends no texture. stale: the probe has newer data of a tile that it
/// needs, or has been silent for three key intervals. invalid_query, with value 0: an argument is not finite, the point
/// is outside the texture, or the viewer is not in front of the plane.
struct PlaneAnswer {
  Radiance value;
  Validity validity = Validity::none;
  PlaneFlags flags;
};

/// A pinhole camera. Camera frame: right-handed, +X right, +Y up, -Z forward, as in OpenXR and OpenGL. A point (x, y,
/// z) in it has the pixel coordinates (cx - fx x / z, cy + fy y / z); the centre of the top left pixel is (0, 0). For
/// poses of OpenCV (+Y down, +Z forward) rotate by pi about X.
struct PlaneCamera {
  int width = 0, height = 0;  ///< Pixels, 1 to 32768.
  double fx = 0, fy = 0;      ///< Focal lengths, pixels, above 0.
  double cx = 0, cy = 0;      ///< Principal point, pixels.
  Pose T_plane_camera;        ///< Maps points of the camera's frame to the plane's. Unit quaternion.
};

/// What a call of render() wrote.
struct PlaneRendering {
  Validity validity = Validity::none;  ///< As PlaneAnswer, of all pixels together: the worst.
  PlaneFlags flags;                    ///< Of all pixels together.
  std::size_t pixels = 0;              ///< Number of pixels that were written.
  std::size_t flagged = 0;             ///< Of these: number of pixels with a flag.
};

/// One moment of a captured plane, immutable. Cheap to copy: copies share their state. Any number of threads may query
/// it concurrently. No query throws, blocks or allocates, and no value is NaN.
class PlaneAppearance {
 public:
  /// Validity::none.
  PlaneAppearance() = default;
  /// Used by the SDK.
  PlaneAppearance(std::shared_ptr<const core::PlaneState> state, HostTime now);

  /// valid if the newest update is complete and recent; stale if a tile of it is missing or it is older than three key
  /// intervals; none if nothing was received.
  [[nodiscard]] Validity validity() const;
  /// Time since the newest message was received, when this snapshot was taken.
  [[nodiscard]] Duration age() const { return age_; }
  /// Number of the newest update of which a message was received; 0: none. The data are those of this update if
  /// missing_tiles() is 0.
  [[nodiscard]] std::uint64_t revision() const;
  /// Number of tiles whose newest content has not arrived.
  [[nodiscard]] std::size_t missing_tiles() const;
  /// Units, size, pose, gloss. All zero if nothing was received.
  [[nodiscard]] const PlaneInfo& info() const;
  /// Texels along a side; 0 if the probe sends no texture.
  [[nodiscard]] int texture_edge() const;
  /// Directions from which the plane was seen, for guidance; a tile of it that has not arrived counts as unseen.
  [[nodiscard]] const PlaneCoverage& coverage() const;
  /// plane_guidance() of coverage(). About 1 ms; allocates.
  [[nodiscard]] PlaneGuidance guidance(const PlaneGuidanceOptions& options = {}) const;

  /// Radiance from a point of the plane towards an eye (m, in front of the plane): D bilinear between the centres of
  /// texels, constant beyond the outermost ones, unseen texels left out; S linear between nodes of the lumisphere
  /// (HemisphereGrid::interpolate). Luminance in cd/m² if units are absolute.
  [[nodiscard]] PlaneAnswer radiance(PlanePoint point, Vec3d eye, PlaneLayers layers = PlaneLayers::all) const;

  /// D at a point. To replace the highlight by the mirror image of a virtual object, add the object's own reflection.
  [[nodiscard]] PlaneAnswer diffuse(PlanePoint point) const;

  /// S towards a viewer; need not be normalised.
  [[nodiscard]] PlaneAnswer specular(Vec3d to_viewer) const;

  /// Draws the plane: writes the radiance along the ray through the centre of each pixel that shows the texture, and
  /// leaves the others alone. `rgb`: r, g, b, rows from the top, 3 width height floats. `flags`: empty, or width height
  /// elements for PlaneFlags::bits(). Not antialiased: where texels are smaller than pixels, render larger and average.
  /// invalid_query, and nothing is written: a camera out of range, spans of the wrong length, a camera behind the
  /// plane. none, and nothing is written: as PlaneAnswer. Pixels whose tiles have not arrived are left alone.
  PlaneRendering render(const PlaneCamera& camera, PlaneLayers layers, std::span<float> rgb,
                        std::span<std::uint8_t> flags = {}) const;

 private:
  /// none if a needed part cannot be there.
  [[nodiscard]] Validity base_validity(PlaneLayers layers) const;

  std::shared_ptr<const core::PlaneState> state_;
  Duration age_;
};

/// Counters of a PlaneReader.
struct PlaneReaderStats {
  std::uint64_t messages = 0;      ///< Taken.
  std::uint64_t refused = 0;       ///< Not decodable, contradictory, or of a former capture.
  std::uint64_t tiles = 0;         ///< Stored.
  std::uint64_t tiles_unused = 0;  ///< Already held, or no longer the newest.
};

/// Collects the messages of one captured plane from one source. Order, duplicates and losses do not matter: every
/// message lists the revisions of all tiles, so a tile that did not arrive is noticed with the next message, and
/// arrives again within the key interval. Memory: at most 3 MB. One thread at a time.
class PlaneReader {
 public:
  PlaneReader();
  ~PlaneReader();
  PlaneReader(PlaneReader&&) noexcept;
  PlaneReader& operator=(PlaneReader&&) noexcept;

  /// One message, `received` when it arrived. Errors: those of decode_plane_update(); invalid_argument also for one
  /// that contradicts earlier ones of its capture, and for one of the four captures before this one. After an error
  /// nothing has changed.
  Status take(std::span<const std::byte> message, HostTime received);
  /// The same for the result of decode_plane_update(), for the SDK.
  Status take_update(const Result<PlaneUpdate>& update, HostTime received);

  /// Whether a message was received, and no tile of the newest update is missing.
  [[nodiscard]] bool complete() const;

  /// The plane as received so far. Copies it (about 1 MB) if it changed since the previous snapshot.
  [[nodiscard]] PlaneAppearance snapshot(HostTime now);
  /// The same for the SDK; null before the first message.
  [[nodiscard]] std::shared_ptr<const core::PlaneState> state();

  [[nodiscard]] const PlaneReaderStats& stats() const { return stats_; }

 private:
  std::unique_ptr<core::PlaneState> state_;            ///< Null before the first message.
  std::shared_ptr<const core::PlaneState> published_;  ///< Null if state_ has changed since.
  std::vector<std::uint32_t> former_captures_;         ///< Newest last.
  PlaneReaderStats stats_;
};

}  // namespace lightwell
