// lightwell-calibrate mounting: from pictures and a list of tags to the pose of the probe.
#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/calibration.hpp>
#include <lightwell/text.hpp>

#include "firmware/pose/mounting_room.hpp"
#include "firmware/tools/calibrate_words.hpp"
#include "imaging/image_file.hpp"
#include "pose/mounting.hpp"
#include "support/temp_dir.hpp"
#include "tools/lightwell_calibrate/commands.hpp"

namespace lightwell::calibrate {
namespace {

using test::CommandResult;
using test::kDegree;
using test::run;
using test::TempDir;
using testing::HasSubstr;
using testing::StartsWith;

constexpr int kEdge = 800;

/// The input files of a user: a calibration, sRGB pictures, a list of tags.
struct Room {
  TempDir folder;
  RigParameters rig = test::pair_rig(kEdge);
  std::string calibration, tags, front, back;

  Room() {
    for (LensParameters& lens : rig.lenses) lens.photometry.response.kind = ResponseCurve::Kind::srgb;
    calibration = folder.write("rig.textproto", calibration_to_text(rig));
    std::string csv = "# tags on four walls\nid,size_m,tx,ty,tz,qx,qy,qz,qw\n";
    std::vector<test::PlacedBoard> boards;
    for (const WorldTag& tag : test::tags_on_walls()) {
      const Vec3d t = tag.world_tag.translation;
      const Quat q = tag.world_tag.rotation;
      csv += std::to_string(tag.id);
      for (const double v : {tag.size_m, t.x, t.y, t.z, q.x, q.y, q.z, q.w}) csv += formatted(", %.17g", v);
      csv += "\n";
      boards.push_back(
          {test::single_tag(tag.id, tag.size_m), {q, transformed(tag.world_tag, tag_corners(tag.size_m)[0])}});
    }
    tags = folder.write("room.csv", csv);
    front = picture(0, boards, "front.png");
    back = picture(1, boards, "back.png");
  }

  std::string picture(std::size_t lens, const std::vector<test::PlacedBoard>& boards, const std::string& name) const {
    test::PictureOptions options;
    options.srgb = true;
    const auto taken = test::BoardCamera(rig.lenses[lens]).take(test::probe_in_room(), boards, options);
    Image image;
    image.width = taken.width;
    image.height = taken.height;
    for (const std::uint8_t v : taken.pixels) image.data.insert(image.data.end(), 3, std::byte{v});
    const Status s = write_png(folder.path(name), image);
    EXPECT_TRUE(s.ok()) << s.message();
    return folder.path(name);
  }
};

const Room& room() {
  static const Room it;
  return it;
}

/// The numbers of the JSON list with the key `name`.
std::vector<double> numbers_after(const std::string& json, const std::string& name) {
  const auto start = json.find('[', json.find("\"" + name + "\""));
  std::string list = json.substr(start + 1, json.find(']', start) - start - 1);
  // Of a list of lists, the first one.
  std::replace(list.begin(), list.end(), '[', ' ');
  std::replace(list.begin(), list.end(), ',', ' ');
  std::istringstream words(list);
  std::vector<double> out;
  for (double value = 0; words >> value;) out.push_back(value);
  return out;
}

TEST(MountingCommand, EstimatesThePoseFromPicturesOfBothLenses) {
  const CommandResult result = run(mounting_command, {"--calibration", room().calibration, "--tags", room().tags,
                                                      room().front, "--lens", "1", room().back, "--json"});
  ASSERT_EQ(result.status, 0) << result.err;
  const auto t = numbers_after(result.out, "translation_m"), q = numbers_after(result.out, "rotation_xyzw");
  ASSERT_EQ(t.size(), 3u) << result.out;
  ASSERT_EQ(q.size(), 4u);
  const auto e = test::error_of({{q[0], q[1], q[2], q[3]}, {t[0], t[1], t[2]}}, test::probe_in_room());
  EXPECT_LT(std::hypot(e[0], e[1], e[2]), 0.05 * kDegree);
  EXPECT_LT(std::hypot(e[3], e[4], e[5]), 0.002);
  EXPECT_THAT(result.out, HasSubstr("\"position_known\":true,\"heading_known\":true,\"ambiguous\":false"));
  EXPECT_THAT(result.out, HasSubstr("\"lens\":1"));
  EXPECT_EQ(numbers_after(result.out, "covariance").size(), 6u) << "the first row";
}

TEST(MountingCommand, WritesAFileThatLightwelldReads) {
  const TempDir folder;
  const std::string file = folder.path("room.textproto");
  const CommandResult result = run(
      mounting_command, {"--calibration", room().calibration, "--tags", room().tags, room().front, "--output", file});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, StartsWith("the probe is at"));
  const Result<UncertainPose> written = load_mounting(file);
  ASSERT_TRUE(written.ok()) << written.status().message();
  const auto e = test::error_of(written->pose, test::probe_in_room());
  EXPECT_LT(std::hypot(e[0], e[1], e[2]), 0.05 * kDegree);
  EXPECT_LT(std::hypot(e[3], e[4], e[5]), 0.003);
  EXPECT_GT(written->covariance[0][0], 0);
  // Standard output has only the message.
  const CommandResult alone = run(mounting_command, {"--gravity", "0,9.8,0", "--output", "-"});
  ASSERT_EQ(alone.status, 0) << alone.err;
  const Result<UncertainPose> up = parse_mounting(alone.out, "stdout");
  ASSERT_TRUE(up.ok()) << up.status().message() << alone.out;
  EXPECT_TRUE(std::isinf(up->covariance[1][1])) << "gravity gives no heading";
  EXPECT_EQ(run(mounting_command, {"--gravity", "0,9.8,0", "--output", "-", "--json"}).status, 2);
  EXPECT_EQ(run(mounting_command, {"--gravity", "0,9.8,0", "--output", "/no/such/folder/room"}).status, 1);
}

TEST(MountingCommand, AcceptsABoardAtAKnownPose) {
  TagBoard board;
  board.columns = 4;
  board.rows = 3;
  board.tag_size_m = 0.12;
  board.first_id = 100;
  const TempDir folder;
  const auto yaml = folder.write("board.yaml", tag_board_to_text(board));
  const auto picture = room().picture(0, {{board, {{}, {-0.3, 1.0, -1.8}}}}, "board.png");
  const CommandResult result = run(mounting_command, {"--calibration", room().calibration, "--board", yaml,
                                                      "--board-pose", "-0.3,1.0,-1.8,0,0,0,1", picture});
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, StartsWith("the probe is at (0.3")) << result.out;
  EXPECT_THAT(result.out, HasSubstr("tag36h11 111 in lens 0: RMS 0.0"));
}

TEST(MountingCommand, GravityAloneGivesInfiniteUncertainty) {
  const CommandResult json = run(mounting_command, {"--gravity", "0,9.8,0", "--json"});
  EXPECT_EQ(json.status, 0) << json.err;
  EXPECT_THAT(json.out, HasSubstr("\"Infinity\""));
  EXPECT_THAT(json.out, HasSubstr("\"position_known\":false,\"heading_known\":false"));
  const CommandResult words = run(mounting_command, {"--gravity", "0,9.8,0", "--gravity-sigma-deg", "2"});
  EXPECT_THAT(words.out, StartsWith("the position and the heading of the probe are unknown"));
  EXPECT_THAT(words.out, HasSubstr("+- (2, inf, 2) deg"));
}

TEST(MountingCommand, ExitStatusOfWrongUsageAndWrongInput) {
  const auto error_text = [](int status, std::vector<std::string> words) {
    const CommandResult s = run(mounting_command, std::move(words));
    EXPECT_EQ(s.status, status) << s.err;
    return s.err;
  };
  const Room& r = room();
  EXPECT_THAT(error_text(2, {}), HasSubstr("give pictures, or --gravity"));
  EXPECT_THAT(error_text(2, {"a.png"}), HasSubstr("need --calibration"));
  EXPECT_THAT(error_text(2, {"--calibration", "c", "a.png"}), HasSubstr("need --tags or --board"));
  EXPECT_THAT(error_text(2, {"--board", "b", "--calibration", "c", "a.png"}), HasSubstr("go together"));
  EXPECT_THAT(error_text(2, {"--board-pose", "0,0,0,0,0,0,2"}), HasSubstr("length must be 1"));
  EXPECT_THAT(error_text(2, {"--board-pose", "0,0,0"}), HasSubstr("tx,ty,tz"));
  EXPECT_THAT(error_text(2, {"--gravity", "0,nan,0"}), HasSubstr("x,y,z"));
  EXPECT_THAT(error_text(2, {"--gravity", "0,1,0", "--gravity-sigma-deg", "0"}), HasSubstr("above 0"));
  EXPECT_THAT(error_text(2, {"--gravity-sigma-deg", "1", "a.png"}), HasSubstr("requires --gravity"));
  EXPECT_THAT(error_text(2, {"--tag", "x"}), HasSubstr("did you mean --tags?"));
  EXPECT_THAT(error_text(2, {"--tags", "a", "--tags", "b"}), HasSubstr("--tags: At Most 1 required but received 2"));
  EXPECT_THAT(error_text(1, {"--gravity", "0,0,0"}), HasSubstr("up_probe is zero"));
  EXPECT_THAT(error_text(1, {"--calibration", "/none", "--tags", r.tags, r.front}), HasSubstr("/none"));
  EXPECT_THAT(error_text(1, {"--calibration", r.calibration, "--tags", "/none", r.front}),
              HasSubstr("/none: cannot be opened"));
  EXPECT_THAT(error_text(1, {"--calibration", r.calibration, "--tags", r.tags, "--lens", "2", r.front}),
              HasSubstr("lens 2 is not in the calibration"));
  Image small;
  small.width = small.height = 40;
  small.data.resize(40 * 40 * 3);
  ASSERT_TRUE(write_png(r.folder.path("small.png"), small).ok());
  EXPECT_THAT(error_text(1, {"--calibration", r.calibration, "--tags", r.tags, r.folder.path("small.png")}),
              HasSubstr("has 40x40 pixels, the calibration of lens 0 is for 800x800"));
  Image black;
  black.width = black.height = kEdge;
  black.data.resize(static_cast<std::size_t>(kEdge) * kEdge * 3);
  ASSERT_TRUE(write_png(r.folder.path("black.png"), black).ok());
  EXPECT_THAT(error_text(1, {"--calibration", r.calibration, "--tags", r.tags, r.folder.path("black.png")}),
              HasSubstr("no tag is seen"));
  const CommandResult help = run(mounting_command, {"-h"});
  EXPECT_EQ(help.status, 0);
  EXPECT_THAT(help.out, HasSubstr("lightwell-calibrate mounting --calibration"));
}

TEST(WorldTags, ErrorsNameTheLine) {
  const std::string head = "family,id,size_m,tx,ty,tz,qx,qy,qz,qw\n";
  const auto refused = [](const std::string& text) {
    const auto tags = parse_world_tags(text, "room.csv");
    EXPECT_FALSE(tags) << text;
    return tags.ok() ? "accepted" : tags.status().message();
  };
  const auto good =
      parse_world_tags(head + "\n# by the door\ntagStandard41h12, 4, 0.1, 1,2,3, 0,1,0,0\r\n", "room.csv");
  ASSERT_TRUE(good) << good.status().message();
  EXPECT_EQ((*good)[0].family, TagFamily::tagStandard41h12);
  EXPECT_EQ((*good)[0].world_tag.translation, (Vec3d{1, 2, 3}));
  EXPECT_EQ((*good)[0].world_tag.rotation.y, 1);
  EXPECT_THAT(refused("id,size,tx\n"), HasSubstr("room.csv:1: unknown column 'size'; did you mean 'size_m'?"));
  EXPECT_THAT(refused("id,size_m,tx,ty,tz,qx,qy,qz\n"), HasSubstr("column qw is missing"));
  EXPECT_THAT(refused("id,id\n"), HasSubstr("column id is listed twice"));
  EXPECT_THAT(refused(head), HasSubstr("lists no tag"));
  EXPECT_THAT(refused(head + "tag36h11,1,0.1,0,0,0,0,0,0\n"), HasSubstr("room.csv:2: 9 cells"));
  EXPECT_THAT(refused(head + "tag36h11,587,0.1,0,0,0,0,0,0,1\n"), HasSubstr("has no tag 587"));
  EXPECT_THAT(refused(head + "tag36h11,-1,0.1,0,0,0,0,0,0,1\n"), HasSubstr("'-1'"));
  EXPECT_THAT(refused(head + "tag16h5,1,0.1,0,0,0,0,0,0,1\n"), HasSubstr("known are"));
  EXPECT_THAT(refused(head + "tag36h11,1,0,0,0,0,0,0,0,1\n"), HasSubstr("size_m must be positive"));
  EXPECT_THAT(refused(head + "tag36h11,1,0.1,inf,0,0,0,0,0,1\n"), HasSubstr("tx: 'inf'"));
  EXPECT_THAT(refused(head + "tag36h11,1,0.1,0,0,0,0,0,0,0\n"), HasSubstr("length is 0"));
  EXPECT_THAT(refused(head + "tag36h11,1,0.1,0,0,0,0,0,0,1\ntag36h11,1,0.1,0,0,0,0,0,0,1\n"),
              HasSubstr("room.csv:3: tag36h11 1 is listed twice"));
}

}  // namespace
}  // namespace lightwell::calibrate
