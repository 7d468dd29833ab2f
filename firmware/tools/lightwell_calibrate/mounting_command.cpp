#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <lightwell/calibration.hpp>
#include <lightwell/files.hpp>
#include <lightwell/text.hpp>

#include "calibration/model/response.hpp"
#include "pose/grey_view.hpp"
#include "pose/mounting.hpp"
#include "pose/tag_detector.hpp"
#include "tools/command_line.hpp"
#include "tools/lens_image.hpp"
#include "tools/lightwell_calibrate/commands.hpp"

namespace lightwell::calibrate {

namespace {

constexpr double kDegree = std::numbers::pi / 180;

constexpr const char* kFooter = R"(Examples:
  lightwell-calibrate mounting --calibration RIG.textproto --tags room.csv front.png --lens 1 back.png
  lightwell-calibrate mounting --calibration RIG.textproto --board board.yaml --board-pose 0,1.2,-2,0,0,0,1 a.png
  lightwell-calibrate mounting --gravity 0.1,9.8,-0.3

The CSV of --tags has the columns family, id, size_m, tx, ty, tz, qx, qy, qz, qw: T_world_tag in metres. A tag's frame:
its centre, +X right, +Y up, +Z towards the viewer. A board's frame: the bottom left corner of its bottom left tag, axes
as a tag's.
Pictures are PNG or JPEG, one per lens, of the calibration's size. World and probe: +X right, +Y up, -Z forward. The
covariance is that of (rotation, translation) in the world frame, rad and m; unknown components are "Infinity".
Exit status: 0 done, 1 an input is wrong (standard error has the reason and the remedy), 2 wrong usage.)";

struct PictureArgument {
  std::string path;
  int lens = 0;
};

struct Arguments {
  std::string calibration, tags, board, output;
  std::optional<Pose> board_pose;
  std::vector<PictureArgument> pictures;
  std::optional<GravityReading> gravity;
  MountingOptions options;
  bool json = false;
};

Result<Pose> parse_board_pose(const std::string& text) {
  const auto wrong = [&](const std::string& form) {
    return invalid_argument("'" + text + "' is not a valid value: " + form);
  };
  const auto n = parse_numbers<double, 7>(text);
  if (!n) return wrong("tx,ty,tz,qx,qy,qz,qw");
  const auto [tx, ty, tz, x, y, z, w] = *n;
  if (!(std::abs(std::sqrt(x * x + y * y + z * z + w * w) - 1) < 1e-3))
    return wrong("the quaternion's length must be 1");
  return Pose{Quat{x, y, z, w}.normalized(), {tx, ty, tz}};
}

Result<GravityReading> parse_gravity(const std::string& text) {
  const auto n = parse_numbers<double, 3>(text);
  if (!n) return invalid_argument("'" + text + "' is not x,y,z");
  return GravityReading{{(*n)[0], (*n)[1], (*n)[2]}, 0};
}

/// Throws UsageError if something is missing or contradictory.
void check(const Arguments& in) {
  if (in.json && in.output == "-")
    throw UsageError("--json and --output - both use standard output; give another --output");
  if (const Status s = in.options.validate(); !s.ok()) throw UsageError(s.message());
  if (in.board.empty() != !in.board_pose) throw UsageError("--board and --board-pose go together");
  if (in.pictures.empty() && !in.gravity) throw UsageError("give pictures, or --gravity");
  if (!in.pictures.empty() && in.calibration.empty()) throw UsageError("pictures need --calibration");
  if (!in.pictures.empty() && in.tags.empty() && in.board.empty())
    throw UsageError("pictures need --tags or --board, the poses of the tags");
}

std::vector<WorldTag> room_of(const Arguments& arguments) {
  std::vector<WorldTag> room;
  if (!arguments.tags.empty())
    room = require(parse_world_tags(require(read_text_file(arguments.tags)), arguments.tags));
  if (!arguments.board.empty())
    for (const WorldTag& tag : tags_of(require(load_tag_board(arguments.board)), *arguments.board_pose))
      room.push_back(tag);
  return room;
}

void add_tags_in(const PictureArgument& picture, const RigParameters& rig, const std::vector<WorldTag>& room,
                 std::vector<TagObservation>& seen) {
  const Image image = require(read_lens_image(picture.path, rig, picture.lens));
  if (image.format != PixelFormat::rgb8)
    refuse(picture.path + ": tags are detected in PNG and JPEG; this is a float image");
  const LensParameters& lens = rig.lenses[static_cast<std::size_t>(picture.lens)];
  TagDetectorOptions options;
  options.families.clear();
  for (const WorldTag& tag : room)
    if (std::ranges::find(options.families, tag.family) == options.families.end())
      options.families.push_back(tag.family);
  options.linear = linear_table(lens.photometry, 256);
  TagDetector detector = require(TagDetector::make(options));
  const CameraModel model(lens);
  GreyView grey;
  for (const TagDetection& tag : require(detector.detect(grey.of(view_of(image, picture.lens)), &model)))
    seen.push_back({picture.lens, tag});
}

Mounting mounting_of(const Arguments& arguments) {
  if (arguments.pictures.empty()) return require(gravity_mounting(*arguments.gravity));
  const RigParameters rig = require(load_calibration(arguments.calibration));
  const std::vector<WorldTag> room = room_of(arguments);
  std::vector<TagObservation> seen;
  for (const PictureArgument& picture : arguments.pictures) add_tags_in(picture, rig, room, seen);
  return require(find_mounting(rig, room, seen, arguments.gravity, arguments.options));
}

nlohmann::ordered_json json_of(const Mounting& m) {
  nlohmann::ordered_json covariance = nlohmann::ordered_json::array();
  for (const auto& row : m.world_probe.covariance) covariance.push_back(json_numbers(row));
  nlohmann::ordered_json out = {{"world_probe", json_pose(m.world_probe.pose)},
                                {"covariance", std::move(covariance)},
                                {"position_known", m.position_known},
                                {"heading_known", m.heading_known},
                                {"ambiguous", m.ambiguous}};
  if (m.alternative) {
    out["alternative"] = json_pose(*m.alternative);
    out["alternative_excess"] = json_number(m.alternative_excess);
  }
  out["rms_px"] = json_number(m.rms_px);
  out["chi_square"] = json_number(m.chi_square);
  out["tags"] = nlohmann::ordered_json::array();
  for (const TagReport& t : m.tags) {
    nlohmann::ordered_json tag = {{"lens", t.lens},
                                  {"family", to_string(t.family)},
                                  {"id", t.id},
                                  {"rms_px", json_number(t.rms_px)},
                                  {"used", t.used}};
    if (!t.used) tag["left_out"] = t.rejection_reason;
    out["tags"].push_back(std::move(tag));
  }
  return out;
}

std::string text_of(Vec3d v) { return formatted("(%g, %g, %g)", v.x, v.y, v.z); }

void print_summary(const Mounting& m) {
  const auto& [rotation, translation] = m.world_probe.pose;
  const auto sigma = [&](std::size_t i) { return std::sqrt(m.world_probe.covariance[i][i]); };
  const Vec3d forward{0, 0, -1};
  if (m.position_known)
    std::cout << "the probe is at " << text_of(translation) << " m, +- "
              << text_of({1000 * sigma(3), 1000 * sigma(4), 1000 * sigma(5)}) << " mm\n";
  else
    std::cout << "the position and the heading of the probe are unknown\n";
  std::cout << "its forward direction is " << text_of(rotate(rotation, forward)) << ", its up direction "
            << text_of(rotate(rotation, Vec3d{0, 1, 0})) << "; rotation about the world's axes +- "
            << text_of({sigma(0) / kDegree, sigma(1) / kDegree, sigma(2) / kDegree}) << " deg\n";
  for (const TagReport& t : m.tags) {
    std::cout << to_string(t.family) << " " << t.id << " in lens " << t.lens << ": ";
    if (t.used)
      std::cout << "RMS " << std::round(1000 * t.rms_px) / 1000 << " px\n";
    else
      std::cout << "rejected: " << t.rejection_reason << "\n";
  }
  if (m.ambiguous)
    std::cout << "AMBIGUOUS: the pictures would be almost the same with the forward direction "
              << text_of(rotate(m.alternative->rotation, forward))
              << "; show it more or larger tags, or give --gravity\n";
}

}  // namespace

int mounting_command(const std::vector<std::string>& arguments) {
  CLI::App app{"The pose of the probe in the room, from tags at known poses.", "lightwell-calibrate mounting"};
  app.footer(kFooter);
  Arguments in;
  std::vector<std::string> paths;
  std::vector<int> lenses;
  double gravity_sigma_deg = 1;
  const CLI::Option* pictures = app.add_option("PICTURES", paths, "Pictures with tags in view");
  app.add_option("--calibration", in.calibration,
                 "The rig's calibration (proto/lightwell/v1/calibration.proto, text format)");
  app.add_option("--tags", in.tags, "The poses of the tags, CSV (below)");
  app.add_option("--board", in.board, "A board in the room, Kalibr's YAML ...");
  add_parsed_option(app, "--board-pose", in.board_pose, parse_board_pose,
                    "... and its T_world_board: tx,ty,tz,qx,qy,qz,qw");
  const CLI::Option* lens = app.add_option("--lens", lenses, "Lens of the rig that the pictures after it belong to [0]")
                                ->allow_extra_args(false)
                                ->check(CLI::NonNegativeNumber);
  CLI::Option* gravity =
      add_parsed_option(app, "--gravity", in.gravity, parse_gravity,
                        "X,Y,Z: up direction in the probe's frame, the reading of a resting accelerometer;\n"
                        "sufficient alone");
  app.add_option("--gravity-sigma-deg", gravity_sigma_deg, "Standard deviation of its direction [1]")
      ->needs(gravity)
      ->check(number_where("above 0, at most 90", [](double deg) { return deg > 0 && deg <= 90; }));
  app.add_option("--model-error-px", in.options.model_error_px,
                 "Standard deviation of the camera model's error [0.05]");
  app.add_option("--output", in.output,
                 "The pose with its covariance for `lightwelld --mounting` (or `mounting` of its configuration),\n"
                 "which sends it to its clients; - is standard output. Replaced atomically")
      ->check([](const std::string& path) { return path.empty() ? "the name of the file is empty" : ""; });
  app.add_flag("--json", in.json, "Pose, covariance and residuals of the tags as JSON on standard output");
  return run_command(app, arguments, [&] {
    PictureArgument picture;
    for (const auto& [option, index] : in_order(app)) {
      if (option == lens) picture.lens = lenses[index];
      if (option != pictures) continue;
      picture.path = paths[index];
      in.pictures.push_back(picture);
    }
    if (in.gravity) in.gravity->sigma_rad = gravity_sigma_deg * kDegree;
    check(in);

    const Mounting mounting = mounting_of(in);
    if (!in.output.empty()) {
      if (mounting.ambiguous)
        throw InputError({StatusCode::failed_precondition,
                          "the pictures do not decide between two attitudes: nothing was written to " + in.output +
                              "; show larger or more tags, or give --gravity"});
      require(write_output(in.output, mounting_to_text(mounting.world_probe)));
    }
    if (in.json)
      std::cout << json_text(json_of(mounting)) << std::endl;
    else if (in.output != "-")
      print_summary(mounting);
    return kDone;
  });
}

}  // namespace lightwell::calibrate
