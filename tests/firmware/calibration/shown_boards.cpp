#include "firmware/calibration/shown_boards.hpp"

#include <cmath>
#include <numbers>
#include <random>

namespace lightwell::shown {
namespace {

using calibration::Board;
using calibration::BoardObservations;
using calibration::Picture;
using std::numbers::pi;

Vec3d at_angles(double theta, double phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

class Shower {
 public:
  Shower(const Show& show) : show_(show), random_(show.seed) {}

  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

  /// Adds the points of a board that are inside the picture and face the lens.
  void add(const LensParameters& lens, const Board& board, int number, const Pose& lens_from_board, Picture& out) {
    const CameraModel camera(lens);
    const double noise = noise_of(out.capture);
    double shared_x = 0, shared_y = 0;
    std::size_t tag = board.points.size();
    for (std::size_t k = 0; k < board.points.size(); ++k) {
      const Vec3d p = transformed(lens_from_board, board.points[k]);
      // The printed side faces -z.
      if (dot(rotate(lens_from_board.rotation, Vec3d{0, 0, 1}), normalized(p)) < std::cos(75 * pi / 180)) continue;
      const auto pixel = camera.project(p);
      if (!pixel) continue;
      double each = noise;
      if (show_.noise == Noise::contaminated) each *= uniform(0, 1) < 0.1 ? 3 / std::sqrt(1.8) : 1 / std::sqrt(1.8);
      PixelPosition seen{pixel->x + each * normal_(random_), pixel->y + each * normal_(random_)};
      if (show_.noise == Noise::within_tag) {
        if (k / 4 != tag) shared_x = normal_(random_), shared_y = normal_(random_), tag = k / 4;
        seen = {pixel->x + std::sqrt(0.5) * (seen.x - pixel->x + noise * shared_x),
                pixel->y + std::sqrt(0.5) * (seen.y - pixel->y + noise * shared_y)};
      }
      if (uniform(0, 1) < show_.wrong_share) seen = {uniform(0, lens.width - 1.0), uniform(0, lens.height - 1.0)};
      if (seen.x < 0 || seen.y < 0 || seen.x > lens.width - 1 || seen.y > lens.height - 1) continue;
      out.observations.push_back({number, static_cast<int>(k), seen});
    }
  }

  /// A random pose of a board with its centre at angle `theta` from the axis.
  Pose before(const Board& board, double theta) {
    const Vec3d to = at_angles(theta, uniform(0, 2 * pi));
    const Quat q =
        rotation_between({0, 0, 1}, to) * Quat::about({0, 0, 1}, uniform(0, 2 * pi)) *
        Quat::about(normalized(Vec3d{uniform(-1, 1), uniform(-1, 1), 0.01}), uniform(-show_.tilt_rad, show_.tilt_rad));
    const Vec3d middle = (board.points.front() + board.points.back()) * 0.5;
    return {q, to * uniform(show_.nearest_m, show_.farthest_m) - rotate(q, middle)};
  }

 private:
  [[nodiscard]] double noise_of(int capture) const {
    if (show_.noise != Noise::by_picture) return show_.noise_px;
    return show_.noise_px * (capture % 3 == 0 ? 3 : 1) / std::sqrt((9 + 1 + 1) / 3.0);
  }

  Show show_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

}  // namespace

Board board(double spacing) {
  constexpr double kTag = 0.03;
  const double step = kTag * (1 + spacing);
  Board out{"board", {}, 4};
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column)
      for (const auto& [x, y] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}})
        out.points.push_back({column * step + x * kTag, row * step + y * kTag, 0});
  return out;
}

namespace {

/// The board bent to a part of a cylinder or a sphere; distances along the surface are kept.
Board bent(Board flat, const Show& show) {
  if (show.bend == Bend::none) return flat;
  // The second last point is the upper right corner of the last tag.
  const Vec3d last = flat.points[flat.points.size() - 2], middle = (flat.points.front() + last) * 0.5;
  const double half = last.x - middle.x;
  const double radius = half * half / (2 * show.bend_m);
  for (Vec3d& p : flat.points) {
    const double dx = p.x - middle.x, dy = show.bend == Bend::sphere ? p.y - middle.y : 0, along = std::hypot(dx, dy);
    if (along == 0) continue;
    const double shorter = radius * std::sin(along / radius) / along;
    p = {middle.x + dx * shorter, show.bend == Bend::sphere ? middle.y + dy * shorter : p.y,
         radius * (1 - std::cos(along / radius))};
  }
  return flat;
}

}  // namespace

BoardObservations one_lens(const LensParameters& lens, const Show& show) {
  Shower shower(show);
  BoardObservations out;
  out.lenses = {{lens.width, lens.height}};
  out.boards = {board()};
  for (int i = 0; i < show.pictures; ++i) {
    Picture picture;
    picture.name = "picture " + std::to_string(i);
    picture.capture = i;
    // From the axis to beyond the edge, so that the edge is covered, too.
    const double theta = lens.max_angle_rad * (i + 0.5) / show.pictures;
    const Board shown = bent(board(i < show.other_spacing_pictures ? 0.4 : show.spacing), show);
    shower.add(lens, shown, 0, shower.before(shown, theta), picture);
    out.pictures.push_back(std::move(picture));
  }
  return out;
}

BoardObservations pair_of_lenses(const Pair& pair, const Show& show) {
  constexpr int kBoards = 4;
  constexpr double kRate = 20;
  Shower shower(show);
  BoardObservations out;
  out.lenses = {{pair.lens.width, pair.lens.height}, {pair.lens.width, pair.lens.height}};
  // Four boards around the origin, facing inwards, slightly tilted.
  std::vector<Pose> world_from_board;
  for (int b = 0; b < kBoards; ++b) {
    out.boards.push_back(board());
    out.boards.back().name = "board " + std::to_string(b);
    const Vec3d to = normalized(Vec3d{std::cos(pi / 2 * b + 0.2), 0.2 * (b % 2) - 0.1, std::sin(pi / 2 * b + 0.2)});
    const Quat q = rotation_between({0, 0, 1}, to) * Quat::about({1, 0, 0}, shower.uniform(-0.3, 0.3));
    world_from_board.push_back(
        {q, to * 0.45 - rotate(q, (out.boards.back().points.front() + out.boards.back().points.back()) * 0.5)});
  }
  // The rig rotates smoothly: sums of sines, with the speed of a hand-held rig.
  double phase[6];
  for (double& p : phase) p = shower.uniform(0, 2 * pi);
  const auto rig_from_world = [&](double t) {
    const Quat q = Quat::about({0, 1, 0}, 1.3 * t + phase[0]) *
                   Quat::about({1, 0, 0}, 0.8 * std::sin(1.1 * t + phase[1])) *
                   Quat::about({0, 0, 1}, 0.9 * std::sin(0.7 * t + phase[2]));
    return Pose{q,
                {0.08 * std::sin(0.9 * t + phase[3]), 0.06 * std::sin(1.3 * t + phase[4]),
                 0.08 * std::sin(0.8 * t + phase[5])}};
  };
  for (int i = 0; i < show.pictures; ++i) {
    const double t = i / kRate;
    for (int lens = 0; lens < 2; ++lens) {
      Picture picture;
      picture.name = "capture " + std::to_string(i) + ", lens " + std::to_string(lens);
      picture.lens = lens;
      picture.capture = i;
      picture.time_s = t;
      Pose from_world = rig_from_world(lens == 1 ? t + pair.later_s : t);
      if (lens == 1) from_world = compose(pair.lens1_from_lens0, from_world);
      for (int b = 0; b < kBoards; ++b)
        shower.add(pair.lens, out.boards[static_cast<std::size_t>(b)], b,
                   compose(from_world, world_from_board[static_cast<std::size_t>(b)]), picture);
      out.pictures.push_back(std::move(picture));
    }
  }
  return out;
}

}  // namespace lightwell::shown
