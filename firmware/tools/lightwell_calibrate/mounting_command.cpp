#include "tools/lightwell_calibrate/mounting_command.hpp"

#include <algorithm>
#include <iostream>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <lightwell/mounting.hpp>

#include "calibration/model/response.hpp"
#include "pose/mounting.hpp"
#include "pose/tag_detector.hpp"
#include "tools/lightwell_calibrate/arguments.hpp"
#include "tools/lightwell_calibrate/grey_image.hpp"
#include "tools/lightwell_calibrate/json.hpp"
#include "tools/lightwell_calibrate/output.hpp"
#include "tools/lightwell_calibrate/world_tags.hpp"

namespace lightwell::calibrate {

namespace {

constexpr double kDegree = std::numbers::pi / 180;

constexpr const char* kHelp =
    R"(lightwell-calibrate mounting: the pose of the probe in the room, from tags at known poses.

  lightwell-calibrate mounting --calibration RIG.textproto --tags room.csv front.png --lens 1 back.png
  lightwell-calibrate mounting --calibration RIG.textproto --board board.yaml --board-pose 0,1.2,-2,0,0,0,1 a.png
  lightwell-calibrate mounting --gravity 0.1,9.8,-0.3

  --calibration FILE   the rig's calibration (proto/lightwell/v1/calibration.proto, text format)
  --tags FILE          the poses of the tags: CSV with the columns family, id, size_m, tx, ty, tz, qx, qy, qz, qw,
                       T_world_tag in metres; a tag's frame: its centre, +X right, +Y up, +Z towards the viewer
  --board FILE         a board in the room, Kalibr's YAML ...
  --board-pose P       ... and its T_world_board: tx,ty,tz,qx,qy,qz,qw; its frame: the bottom left corner of its
                       bottom left tag, axes as a tag's
  --lens N             lens of the rig that the pictures after it belong to [0]
  --gravity X,Y,Z      up direction in the probe's frame, the reading of a resting accelerometer; sufficient alone
  --gravity-sigma-deg S   standard deviation of its direction [1]
  --model-error-px E   standard deviation of the camera model's error [0.05]
  --output FILE        the pose with its covariance for `lightwelld --mounting` (or `mounting` of its configuration),
                       which sends it to its clients; - is standard output. Replaced atomically
  --json               pose, covariance and residuals of the tags as JSON on standard output
  --help               this text

Pictures are PNG or JPEG, one per lens, of the calibration's size. World and probe: +X right, +Y up, -Z forward. The
covariance is that of (rotation, translation) in the world frame, rad and m; unknown components are "Infinity".
Exit status: 0 done, 1 an input is wrong (standard error has the reason and the remedy), 2 wrong usage.
)";

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
  bool help = false;
};

Result<Arguments> parse(std::span<char* const> words) {
  static const std::vector<std::string_view> kKnown = {"--calibration",       "--tags",           "--board",
                                                       "--board-pose",        "--lens",           "--gravity",
                                                       "--gravity-sigma-deg", "--model-error-px", "--output"};
  const auto usage = [](const std::string& what) {
    return Status(StatusCode::invalid_argument, what + "; see --help");
  };
  const Result<std::vector<Argument>> all = parse_arguments(words, kKnown, {"--json"});
  if (!all) return all.status();
  Arguments out;
  int lens = 0;
  double sigma_deg = 1;
  std::set<std::string> given;
  for (const auto& [option, value] : *all) {
    const auto bad = [&](const std::string& form) {
      return usage(option + ": '" + value + "' is not a valid value: " + form);
    };
    if (option == "--help") {
      out.help = true;
      return out;
    }
    if (option.empty()) {
      out.pictures.push_back({value, lens});
      continue;
    }
    if (option != "--lens" && !given.insert(option).second) return usage(option + " is given twice");
    if (option == "--calibration") {
      out.calibration = value;
    } else if (option == "--tags") {
      out.tags = value;
    } else if (option == "--board") {
      out.board = value;
    } else if (option == "--board-pose") {
      const auto n = numbers(value, 7);
      if (!n) return bad("tx,ty,tz,qx,qy,qz,qw");
      const Quat q{(*n)[3], (*n)[4], (*n)[5], (*n)[6]};
      if (!(std::abs(std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w) - 1) < 1e-3))
        return bad("the quaternion's length must be 1");
      out.board_pose = Pose{q.normalized(), {(*n)[0], (*n)[1], (*n)[2]}};
    } else if (option == "--lens") {
      const auto n = number<int>(value);
      if (!n || *n < 0) return bad("0 or 1");
      lens = *n;
    } else if (option == "--gravity") {
      const auto n = numbers(value, 3);
      if (!n) return bad("x,y,z");
      out.gravity = GravityReading{{(*n)[0], (*n)[1], (*n)[2]}, 0};
    } else if (option == "--gravity-sigma-deg") {
      const auto n = number<double>(value);
      if (!n || !(*n > 0 && *n <= 90)) return bad("above 0, at most 90");
      sigma_deg = *n;
    } else if (option == "--model-error-px") {
      const auto n = number<double>(value);
      if (!n) return bad("a number");
      out.options.model_error_px = *n;
    } else if (option == "--output") {
      if (value.empty()) return bad("a file");
      out.output = value;
    } else if (option == "--json") {
      out.json = true;
    }
  }
  if (out.json && out.output == "-")
    return usage("--json and --output - both use standard output; give another --output");
  if (out.gravity) out.gravity->sigma_rad = sigma_deg * kDegree;
  if (given.contains("--gravity-sigma-deg") && !out.gravity) return usage("--gravity-sigma-deg needs --gravity");
  if (const Status s = out.options.validate(); !s.ok()) return usage(s.message());
  if (out.board.empty() != !out.board_pose) return usage("--board and --board-pose go together");
  if (out.pictures.empty() && !out.gravity) return usage("give pictures, or --gravity");
  if (!out.pictures.empty() && out.calibration.empty()) return usage("pictures need --calibration");
  if (!out.pictures.empty() && out.tags.empty() && out.board.empty())
    return usage("pictures need --tags or --board, the poses of the tags");
  return out;
}

Result<std::vector<WorldTag>> room_of(const Arguments& arguments) {
  std::vector<WorldTag> room;
  if (!arguments.tags.empty()) {
    Result<std::vector<WorldTag>> tags = load_world_tags(arguments.tags);
    if (!tags) return tags.status();
    room = std::move(*tags);
  }
  if (!arguments.board.empty()) {
    const Result<TagBoard> board = load_tag_board(arguments.board);
    if (!board) return board.status();
    const std::vector<WorldTag> tags = tags_of(*board, *arguments.board_pose);
    room.insert(room.end(), tags.begin(), tags.end());
  }
  return room;
}

Result<std::vector<TagObservation>> tags_in(const PictureArgument& picture, const RigParameters& rig,
                                            const std::vector<WorldTag>& room) {
  const auto wrong = [&](const std::string& what) {
    return Status(StatusCode::invalid_argument, picture.path + ": " + what);
  };
  if (static_cast<std::size_t>(picture.lens) >= rig.lenses.size())
    return wrong("belongs to lens " + std::to_string(picture.lens) + " and the calibration has " +
                 std::to_string(rig.lenses.size()));
  const LensParameters& lens = rig.lenses[static_cast<std::size_t>(picture.lens)];
  const Result<GreyImage> image = read_grey(picture.path);
  if (!image) return image.status();
  if (image->width != lens.width || image->height != lens.height)
    return wrong("has " + std::to_string(image->width) + "x" + std::to_string(image->height) +
                 " pixels, the calibration is for " + std::to_string(lens.width) + "x" + std::to_string(lens.height));
  TagDetectorOptions options;
  options.families.clear();
  for (const WorldTag& tag : room)
    if (std::find(options.families.begin(), options.families.end(), tag.family) == options.families.end())
      options.families.push_back(tag.family);
  options.linear = linear_table(lens.photometry, 256);
  Result<TagDetector> detector = TagDetector::make(options);
  if (!detector) return detector.status();
  const CameraModel model(lens);
  const Result<std::vector<TagDetection>> tags = detector->detect(image->view(), &model);
  if (!tags) return tags.status();
  std::vector<TagObservation> out;
  for (const TagDetection& tag : *tags) out.push_back({picture.lens, tag});
  return out;
}

Result<Mounting> mounting_of(const Arguments& arguments) {
  if (arguments.pictures.empty()) return gravity_mounting(*arguments.gravity);
  const Result<RigParameters> rig = load_calibration(arguments.calibration);
  if (!rig) return rig.status();
  const Result<std::vector<WorldTag>> room = room_of(arguments);
  if (!room) return room.status();
  std::vector<TagObservation> seen;
  for (const PictureArgument& picture : arguments.pictures) {
    const Result<std::vector<TagObservation>> tags = tags_in(picture, *rig, *room);
    if (!tags) return tags.status();
    seen.insert(seen.end(), tags->begin(), tags->end());
  }
  return find_mounting(*rig, *room, seen, arguments.gravity, arguments.options);
}

std::string json_of(const Pose& p) {
  return "{\"translation_m\": [" + json_number(p.translation.x) + ", " + json_number(p.translation.y) + ", " +
         json_number(p.translation.z) + "], \"rotation_xyzw\": [" + json_number(p.rotation.x) + ", " +
         json_number(p.rotation.y) + ", " + json_number(p.rotation.z) + ", " + json_number(p.rotation.w) + "]}";
}

std::string to_json(const Mounting& m) {
  const auto flag = [](bool b) { return b ? "true" : "false"; };
  std::string out = "{\"world_probe\": " + json_of(m.world_probe.pose) + ",\n \"covariance\": [";
  for (std::size_t r = 0; r < 6; ++r) {
    out += r ? ",\n  [" : "\n  [";
    for (std::size_t c = 0; c < 6; ++c) out += (c ? ", " : "") + json_number(m.world_probe.covariance[r][c]);
    out += "]";
  }
  out += std::string("],\n \"position_known\": ") + flag(m.position_known) +
         ", \"heading_known\": " + flag(m.heading_known) + ", \"ambiguous\": " + flag(m.ambiguous);
  if (m.alternative)
    out += ",\n \"alternative\": " + json_of(*m.alternative) +
           ", \"alternative_excess\": " + json_number(m.alternative_excess);
  out +=
      ",\n \"rms_px\": " + json_number(m.rms_px) + ", \"chi_square\": " + json_number(m.chi_square) + ",\n \"tags\": [";
  for (std::size_t i = 0; i < m.tags.size(); ++i) {
    const TagReport& t = m.tags[i];
    out += std::string(i ? "," : "") + "\n  {\"lens\": " + std::to_string(t.lens) +
           ", \"family\": " + json_string(to_string(t.family)) + ", \"id\": " + std::to_string(t.id) +
           ", \"rms_px\": " + json_number(t.rms_px) + ", \"used\": " + flag(t.used) +
           (t.used ? "" : ", \"left_out\": " + json_string(t.rejection_reason)) + "}";
  }
  return out + "]}\n";
}

void print_summary(const Mounting& m) {
  const Pose& p = m.world_probe.pose;
  const auto sigma = [&](std::size_t i) { return std::sqrt(m.world_probe.covariance[i][i]); };
  const Vec3d ahead = rotate(p.rotation, Vec3d{0, 0, -1}), up = rotate(p.rotation, Vec3d{0, 1, 0});
  if (m.position_known)
    std::cout << "the probe is at (" << p.translation.x << ", " << p.translation.y << ", " << p.translation.z
              << ") m, +- (" << 1000 * sigma(3) << ", " << 1000 * sigma(4) << ", " << 1000 * sigma(5) << ") mm\n";
  else
    std::cout << "the position and the heading of the probe are unknown\n";
  std::cout << "its forward direction is (" << ahead.x << ", " << ahead.y << ", " << ahead.z << "), its up direction ("
            << up.x << ", " << up.y << ", " << up.z << "); rotation about the world's axes +- (" << sigma(0) / kDegree
            << ", " << sigma(1) / kDegree << ", " << sigma(2) / kDegree << ") deg\n";
  for (const TagReport& t : m.tags)
    std::cout << to_string(t.family) << " " << t.id << " in lens " << t.lens << ": "
              << (t.used ? "RMS " + json_number(std::round(1000 * t.rms_px) / 1000) + " px"
                         : "rejected: " + t.rejection_reason)
              << "\n";
  if (m.ambiguous) {
    const Vec3d other = rotate(m.alternative->rotation, Vec3d{0, 0, -1});
    std::cout << "AMBIGUOUS: the pictures would be almost the same with the forward direction (" << other.x << ", "
              << other.y << ", " << other.z << "); show it more or larger tags, or give --gravity\n";
  }
}

}  // namespace

int mounting_command(std::span<char* const> arguments) {
  const auto fail = [](const Status& s, int exit) {
    std::cerr << "lightwell-calibrate mounting: " << s.message() << "\n";
    return exit;
  };
  const Result<Arguments> parsed = parse(arguments);
  if (!parsed) return fail(parsed.status(), kUsage);
  if (parsed->help) {
    std::cout << kHelp;
    return kDone;
  }
  const Result<Mounting> mounting = mounting_of(*parsed);
  if (!mounting) return fail(mounting.status(), kBadInput);
  if (!parsed->output.empty()) {
    if (mounting->ambiguous)
      return fail({StatusCode::failed_precondition,
                   "the pictures do not decide between two attitudes: nothing was written to " + parsed->output +
                       "; show larger or more tags, or give --gravity"},
                  kBadInput);
    if (const Status s = write_output(parsed->output, mounting_to_text(mounting->world_probe)); !s.ok())
      return fail(s, kBadInput);
  }
  if (parsed->json) {
    std::cout << to_json(*mounting) << std::flush;
  } else if (parsed->output != "-") {
    print_summary(*mounting);
  }
  return kDone;
}

}  // namespace lightwell::calibrate
