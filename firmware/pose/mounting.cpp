#include "pose/mounting.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <set>
#include <utility>

#include <lightwell/text.hpp>

#include "imaging/csv.hpp"
#include "pose/corner_solver.hpp"

namespace lightwell {

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

Status check(const GravityReading& gravity) {
  if (normalized(gravity.up_probe) == Vec3d{})
    return invalid_argument(
        "gravity: up_probe is zero or not a number; give the direction away from the earth in the probe's frame");
  if (!(gravity.sigma_rad > 0) || !std::isfinite(gravity.sigma_rad))
    return invalid_argument("gravity: sigma_rad is " + std::to_string(gravity.sigma_rad) + "; it must be positive");
  return {};
}

Status check(std::span<const WorldTag> room) {
  std::set<std::pair<TagFamily, int>> known;
  for (const WorldTag& tag : room) {
    const std::string name = "room: " + std::string(to_string(tag.family)) + " " + std::to_string(tag.id);
    const Quat q = tag.world_tag.rotation;
    const Vec3d t = tag.world_tag.translation;
    const double norm = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
    if (!(tag.size_m > 0) || !std::isfinite(tag.size_m))
      return invalid_argument(name + ": its size must be positive, in metres");
    if (!(std::abs(norm - 1) < 1e-3))
      return invalid_argument(name + ": its quaternion has the length " + std::to_string(norm) + ", not 1");
    if (!std::isfinite(t.x + t.y + t.z)) return invalid_argument(name + ": its position is not a number");
    if (!known.emplace(tag.family, tag.id).second) return invalid_argument(name + " is listed twice");
  }
  return {};
}

/// Columns of parse_world_tags(), the optional one first.
const std::vector<std::string_view> kColumns = {"family", "id", "size_m", "tx", "ty", "tz", "qx", "qy", "qz", "qw"};
constexpr std::size_t kRequiredColumns = 1;

Result<WorldTag> tag_of(const CsvRow& row) {
  WorldTag tag;
  if (const auto family = row.cells.find("family"); family != row.cells.end())
    if (const Status s = parse_tag_family(family->second).assign_to(tag.family); !s.ok()) return row.bad(s.message());
  const std::string& id = row.cells.at("id");
  tag.id = parse_number<int>(id).value_or(-1);
  if (tag.id < 0) return row.bad("id: '" + id + "' is not a tag's number");
  Vec3d& t = tag.world_tag.translation;
  Quat& q = tag.world_tag.rotation;
  double* const numbers[] = {&tag.size_m, &t.x, &t.y, &t.z, &q.x, &q.y, &q.z, &q.w};
  for (std::size_t i = 0; i < std::size(numbers); ++i)
    if (const Status s = row.read(kColumns[i + 2], *numbers[i]); !s.ok()) return s;
  if (tag.id >= shape_of(tag.family).tags)
    return row.bad(std::string(to_string(tag.family)) + " has no tag " + std::to_string(tag.id));
  if (!(tag.size_m > 0)) return row.bad("size_m must be positive, in metres");
  const double norm = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
  if (!(std::abs(norm - 1) < 1e-3)) return row.bad("the quaternion's length is " + std::to_string(norm) + ", not 1");
  q = q.normalized();
  return tag;
}

}  // namespace

Result<std::vector<WorldTag>> parse_world_tags(std::string_view text, const std::string& name) {
  const Result<std::vector<CsvRow>> rows = parse_csv(text, name, kColumns, kRequiredColumns, true);
  if (!rows) return rows.status();
  std::vector<WorldTag> out;
  for (const CsvRow& row : *rows) {
    const Result<WorldTag> tag = tag_of(row);
    if (!tag) return tag.status();
    for (const WorldTag& other : out)
      if (other.family == tag->family && other.id == tag->id)
        return row.bad(std::string(to_string(tag->family)) + " " + std::to_string(tag->id) + " is listed twice");
    out.push_back(*tag);
  }
  if (out.empty()) return invalid_argument(name + ": lists no tag");
  return out;
}

Status MountingOptions::validate() const {
  if (!(model_error_px >= 0 && model_error_px <= 100))
    return invalid_argument("model_error_px is " + std::to_string(model_error_px) + "; it must be 0 to 100");
  return {};
}

std::vector<WorldTag> tags_of(const TagBoard& board, const Pose& world_board) {
  std::vector<WorldTag> out;
  for (int i = 0; i < board.tags(); ++i) {
    const int id = board.first_id + i;
    out.push_back(
        {board.family, id, board.tag_size_m, {world_board.rotation, transformed(world_board, board.center(id))}});
  }
  return out;
}

Result<Mounting> gravity_mounting(const GravityReading& gravity) {
  if (const Status s = check(gravity); !s.ok()) return s;
  Mounting out;
  out.world_probe.pose.rotation = rotation_between(normalized(gravity.up_probe), {0, 1, 0});
  PoseCovariance& c = out.world_probe.covariance;
  // Gravity measures rotations about the world's X and Z; it does not depend on the heading (about Y).
  c[0][0] = c[2][2] = gravity.sigma_rad * gravity.sigma_rad;
  for (const std::size_t i : {1u, 3u, 4u, 5u}) c[i][i] = kInfinite;
  return out;
}

Result<Mounting> find_mounting(const RigParameters& rig, std::span<const WorldTag> room,
                               std::span<const TagObservation> observations,
                               const std::optional<GravityReading>& gravity, const MountingOptions& options) {
  if (const Status s = options.validate(); !s.ok()) return s;
  if (const Status s = check(room); !s.ok()) return s;
  if (gravity)
    if (const Status s = check(*gravity); !s.ok()) return s;
  const PosedLenses lenses(rig);
  static const std::string kUnknown = "it is not in the room's list";
  Result<ObservedTags> seen =
      observed_tags(lenses, room, observations, options.model_error_px, kUnknown, /*unique=*/true);
  if (!seen) return seen.status();
  if (seen->tags.empty()) {
    if (!gravity) {
      std::string why = "no tag is seen";
      for (const TagReport& report : seen->reports)
        why = seen->reports.size() == 1 || report.rejection_reason != kUnknown
                  ? report.rejection_reason
                  : "none of the " + std::to_string(observations.size()) + " seen tags is in the room's list";
      return invalid_argument(why + ", and no gravity is given");
    }
    Result<Mounting> up = gravity_mounting(*gravity);
    if (up) up->tags = std::move(seen->reports);
    return up;
  }
  const Quads all = seen->all();
  CornerSolution best = consensus_pose(all, gravity);
  if (!std::isfinite(best.cost)) return Status(StatusCode::internal, "mounting: the solver found no pose at all");
  const Quads used = find_inliers(all, best.probe_world());
  if (2 * used.size() <= all.size()) {
    std::string names;
    for (const ObservedTag* quad : all)
      if (std::find(used.begin(), used.end(), quad) == used.end())
        names += (names.empty() ? "" : ", ") + name_of(observations[quad->index]);
    return Status(StatusCode::failed_precondition, "the tags contradict each other (against the rest: " + names +
                                                       "); check the pose and the size of each in the room's list");
  }
  best = solve_pose(used, gravity, best.probe_world(), Loss::huber);
  CornerSolution other = solve_pose(used, gravity, mirror_pose(used, best.probe_world()), Loss::huber);
  if (other.cost < best.cost) std::swap(best, other);

  Mounting out;
  out.position_known = out.heading_known = true;
  const double freedom = 8.0 * static_cast<double>(used.size()) + (gravity ? 2 : 0) - 6;
  out.chi_square = best.cost / freedom;
  const double scale = std::max(1.0, out.chi_square);
  const std::optional<Matrix6d> noise = pose_covariance_of(best);
  if (!noise)
    return Status(
        StatusCode::failed_precondition,
        "the corners seen do not determine a pose; move the probe so that it sees a tag larger or less on edge");
  // The covariance of T_world_probe does not depend on the position of the world's origin.
  out.world_probe = inverse(UncertainPose{best.probe_centroid, covariance_from(scale * *noise)});
  out.world_probe.pose.translation += best.centroid;

  // Report the second pose only if the two minimisations did not converge to the same minimum.
  if (std::isfinite(other.cost) && are_distinct(best, other)) {
    out.alternative = inverse(other.probe_world());
    out.alternative_excess = log_likelihood_ratio(best.cost, other.cost, freedom);
    out.ambiguous = out.alternative_excess < kAmbiguousLogRatio;
  }
  out.rms_px = report_residuals(lenses, observations, used, best.probe_world(), *seen);
  out.tags = std::move(seen->reports);
  return out;
}

}  // namespace lightwell
