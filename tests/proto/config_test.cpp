#include <array>
#include <cmath>
#include <fstream>
#include <limits>

#include <gtest/gtest.h>

#include <lightwell/config.hpp>

#include "support/temp_dir.hpp"

namespace lightwell {
namespace {

std::string refusal(std::string_view text) {
  const auto c = parse_config(text, "probe.textproto");
  EXPECT_FALSE(c.ok());
  return c.status().message();
}

TEST(Config, CameraOnlyHasTheDocumentedDefaults) {
  const auto c = parse_config("camera { uri: \"sim:city\" }", "x");
  ASSERT_TRUE(c.ok()) << c.status().message();
  EXPECT_EQ(c->probe_name, "lightwell");
  EXPECT_EQ(c->camera.width, 640);
  EXPECT_EQ(c->camera.height, 480);
  EXPECT_EQ(c->camera.frame_rate, 30);
  EXPECT_EQ(c->estimator.band, 6);
  EXPECT_EQ(c->estimator.max_lights, 16);
  EXPECT_EQ(c->estimator.panorama.epsilon, 0.01);
  EXPECT_EQ(c->estimator.setting, Setting::balanced);
  EXPECT_EQ(c->estimator.panorama.unseen, UnseenFill::none);
  EXPECT_EQ(c->estimator.panorama.smoothing, Smoothing::one_euro);
  EXPECT_EQ(c->estimator.panorama.environment_edge, 0);
  EXPECT_EQ(c->grpc.listen_address, "127.0.0.1:7420");
}

TEST(Config, CameraUriArgumentReplacesTheFiles) {
  EXPECT_EQ(parse_config("estimator { band: 2 }", "x", "sim:night")->camera.uri, "sim:night");
  EXPECT_EQ(parse_config("camera { uri: \"sim:city\" }", "x", "sim:night")->camera.uri, "sim:night");
}

TEST(Config, DefaultHasNoBudget) {
  EXPECT_EQ(parse_config("camera { uri: \"sim:city\" }", "x")->budget_ms, 0);
  EXPECT_EQ(parse_config("camera { uri: \"sim:city\" } budget_ms: 2.5", "x")->budget_ms, 2.5);
  EXPECT_EQ(parse_config("camera { uri: \"sim:city\" } max_bound: 0.02", "x")->max_bound, 0.02);
}

TEST(Config, WithAnUnknownFieldNamesFileLineAndTheNearestName) {
  const std::string m = refusal("probe_name: \"a\"\ncamera {\n  uri: \"sim:city\"\n  frame_rat: 30\n}\n");
  EXPECT_NE(m.find("probe.textproto:4:"), std::string::npos) << m;
  EXPECT_NE(m.find("frame_rate"), std::string::npos) << m;
  EXPECT_NE(m.find("did you mean"), std::string::npos) << m;
}

TEST(Config, FieldWithoutASimilarNameListsAllFields) {
  const std::string m = refusal("zzzzzzzzzzzzz: 1");
  EXPECT_NE(m.find("probe.textproto:1:"), std::string::npos) << m;
  EXPECT_NE(m.find("camera"), std::string::npos) << m;
}

TEST(Config, RejectsInvalidValuesNamingTheField) {
  EXPECT_NE(refusal("camera { width: 640 }").find("camera.uri"), std::string::npos);
  EXPECT_NE(refusal("camera { uri: \"x:\" width: 3 }").find("size"), std::string::npos);
  EXPECT_NE(refusal("camera { uri: \"x:\" exposure_s: -1 }").find("exposure_s"), std::string::npos);
  EXPECT_NE(refusal("camera { uri: \"x:\" exposure_s: nan }").find("exposure_s"), std::string::npos);
  EXPECT_NE(refusal("camera { uri: \"x:\" } estimator { band: 9 }").find("band"), std::string::npos);
  for (const char* bad : {"-0.01", "1", "nan"})
    EXPECT_NE(refusal(std::string("camera { uri: \"x:\" } max_bound: ") + bad).find("max_bound"), std::string::npos);
  EXPECT_NE(refusal("camera { uri: \"x:\" } budget_ms: -1").find("budget_ms"), std::string::npos);
  EXPECT_NE(refusal("camera { uri: \"x:\" } budget_ms: nan").find("budget_ms"), std::string::npos);
  EXPECT_NE(refusal("camera { uri: \"x:\" } budget_ms: inf").find("budget_ms"), std::string::npos);
  EXPECT_NE(refusal("camera { uri: \"x:\" } estimator { max_lights: 65 }").find("max_lights"), std::string::npos);
}

TEST(Config, ParsesTheCaptureSettings) {
  const auto plain = parse_config("camera { uri: \"x:\" }", "x");
  EXPECT_TRUE(plain->camera.capture.exposure_s.empty());
  EXPECT_FALSE(plain->camera.capture.gain || plain->camera.capture.white_balance_k ||
               plain->camera.capture.colour_gains);
  const auto c = parse_config(
      "camera { uri: \"x:\" exposure_s: [0.001, 0.008] gain: 2 white_balance_k: 4600 colour_gains: [1.8, 1.5] }", "x");
  ASSERT_TRUE(c.ok()) << c.status().message();
  EXPECT_EQ(c->camera.capture.exposure_s, (std::vector<double>{0.001, 0.008}));
  EXPECT_EQ(c->camera.capture.gain, 2);
  EXPECT_EQ(c->camera.capture.white_balance_k, 4600);
  EXPECT_EQ(c->camera.capture.colour_gains, (std::array<double, 2>{1.8, 1.5}));
  EXPECT_NE(refusal("camera { uri: \"x:\" colour_gains: 1 }").find("camera.colour_gains"), std::string::npos);
}

TEST(Config, CaptureSettingsAreChecked) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -0.01, std::nan(""), kInfinity}) {
    EXPECT_FALSE((CaptureSettings{.exposure_s = {0.01, bad}}).validate().ok()) << bad;
    EXPECT_FALSE((CaptureSettings{.gain = bad}).validate().ok()) << bad;
    EXPECT_FALSE((CaptureSettings{.white_balance_k = bad}).validate().ok()) << bad;
    EXPECT_FALSE((CaptureSettings{.colour_gains = std::array<double, 2>{1, bad}}).validate().ok()) << bad;
  }
  EXPECT_TRUE((CaptureSettings{.exposure_s = std::vector<double>(8, 0.01)}).validate().ok());
  EXPECT_FALSE((CaptureSettings{.exposure_s = std::vector<double>(9, 0.01)}).validate().ok());
}

/// Each entry of kRenamedFields.
TEST(Config, FormerNamesOfFieldsAreAcceptedWithAWarning) {
  const auto c = parse_config(
      "camera { uri: \"replay:keys: \\\"listen: { body: \" }  # body: of a comment\n"
      "grpc {\n  listen: \"[::]:0\"  # keys: \n  keys\n  : 'k' security: LINK_SECURITY_TLS paired_days:30\n}\n"
      "usb_gadget < ffs: \"/f\" >\n"
      "estimator: { panorama { epsilon: 1e-3, unseen: UNSEEN_FILL_MIRROR; smoothing: SMOOTHING_NONE } band: 2 }\n",
      "probe.textproto");
  ASSERT_TRUE(c.ok()) << c.status().message();
  EXPECT_EQ(c->camera.uri, "replay:keys: \"listen: { body: ");
  EXPECT_EQ(c->grpc.listen_address, "[::]:0");
  EXPECT_EQ(c->grpc.key_folder, "k");
  EXPECT_EQ(c->grpc.client_certificate_days, 30);
  EXPECT_EQ(c->usb_gadget->functionfs_mount, "/f");
  EXPECT_EQ(c->estimator.panorama.unseen, UnseenFill::mirror);
  EXPECT_EQ(c->estimator.band, 2);
  ASSERT_EQ(c->warnings.size(), 5U);
  EXPECT_EQ(c->warnings[1],
            "probe.textproto:4: field 'keys' is now called 'key_folder': the former name is deprecated");
  const auto marker = parse_config("camera { uri: \"x:\" } marker { body: \"b\" }", "x");
  ASSERT_TRUE(marker.ok()) << marker.status().message();
  EXPECT_EQ(marker->marker->body_file, "b");
  EXPECT_EQ(marker->warnings.size(), 1U);
}

TEST(Config, AFormerNameElsewhereOrBesideTheCurrentOneIsRefused) {
  EXPECT_NE(refusal("camera {\n uri: \"x:\"\n listen: \"y\"\n}").find("probe.textproto:3:"), std::string::npos);
  const std::string both = refusal("camera { uri: \"x:\" }\ngrpc { listen: \"a:1\" listen_address: \"b:1\" }");
  EXPECT_NE(both.find("probe.textproto:2:"), std::string::npos) << both;
  EXPECT_NE(both.find("listen_address"), std::string::npos) << both;
  for (const std::string torn : {"grpc { listen: \"", "grpc { listen: \"a\\", "}}>> grpc { listen", "grpc { listen:",
                                 "grpc { listen listen_address: \"a\" }", "grpc { listen # listen\n \"a\" }"})
    EXPECT_FALSE(parse_config("camera { uri: \"x:\" } " + torn, "x").ok()) << torn;
}

TEST(Config, ParsesTheGlossyPlane) {
  EXPECT_FALSE(parse_config("camera { uri: \"sim:city\" }", "x")->plane.has_value());
  const auto c = parse_config("camera { uri: \"v4l2:/dev/video0\" } plane { plane_file: \"book.textproto\" }", "x");
  ASSERT_TRUE(c.ok()) << c.status().message();
  ASSERT_TRUE(c->plane.has_value());
  EXPECT_EQ(c->plane->plane_file, "book.textproto");
  EXPECT_EQ(c->estimator_kind, EstimatorKind::specular);
}

TEST(Config, APlaneMayComeAfterTheFile) {
  auto c = parse_config("camera { uri: \"x:\" }", "x", {}, EstimatorKind::specular);
  ASSERT_TRUE(c.ok()) << c.status().message();
  EXPECT_NE(c->validate().message().find("--estimator specular needs a plane"), std::string::npos);
  c->plane = PlaneConfig{"p"};
  EXPECT_TRUE(c->validate().ok());
}

TEST(Config, InvalidPlaneIsRejectedByName) {
  const std::string missing = refusal("camera { uri: \"x:\" } plane {}");
  EXPECT_NE(missing.find("plane.plane_file is missing"), std::string::npos) << missing;
  const std::string both = refusal("camera { uri: \"x:\" } plane { plane_file: \"p\" } marker { body_file: \"b\" }");
  EXPECT_NE(both.find("plane cannot be combined with marker"), std::string::npos) << both;
  const std::string patch =
      refusal("camera { uri: \"x:\" } plane { plane_file: \"p\" } grey_patch { width: 8 height: 8 }");
  EXPECT_NE(patch.find("grey_patch cannot be combined with plane"), std::string::npos) << patch;
}

TEST(Config, ParsesTheMarkerBody) {
  EXPECT_FALSE(parse_config("camera { uri: \"sim:city\" }", "x")->marker.has_value())
      << "a panorama, unless a marker is named";
  const auto c =
      parse_config("camera { uri: \"v4l2:/dev/video0\" } marker { body_file: \"dodecahedron.textproto\" }", "x");
  ASSERT_TRUE(c.ok()) << c.status().message();
  ASSERT_TRUE(c->marker.has_value());
  EXPECT_EQ(c->marker->body_file, "dodecahedron.textproto");
  EXPECT_EQ(c->estimator_kind, EstimatorKind::marker);
}

TEST(Config, ABodyMayComeAfterTheFile) {
  auto c = parse_config("camera { uri: \"x:\" }", "x", {}, EstimatorKind::marker);
  ASSERT_TRUE(c.ok()) << c.status().message();
  EXPECT_NE(c->validate().message().find("needs a body"), std::string::npos);
  c->marker = MarkerConfig{"b"};
  EXPECT_TRUE(c->validate().ok());
}

TEST(Config, InvalidMarkerIsRejectedByName) {
  const std::string bodiless = refusal("camera { uri: \"x:\" } marker {}");
  EXPECT_NE(bodiless.find("marker.body_file is missing"), std::string::npos) << bodiless;
  EXPECT_NE(bodiless.find("lightwell-calibrate marker-sheet"), std::string::npos) << bodiless;
  const std::string both =
      refusal("camera { uri: \"x:\" } marker { body_file: \"b\" } grey_patch { width: 8 height: 8 }");
  EXPECT_NE(both.find("grey_patch cannot be combined with marker"), std::string::npos) << both;
  const std::string misspelt = refusal("camera { uri: \"x:\" }\nmarker {\n  body_fil: \"b\"\n}\n");
  EXPECT_NE(misspelt.find("probe.textproto:3:"), std::string::npos) << misspelt;
  EXPECT_NE(misspelt.find("'body_file'"), std::string::npos) << misspelt;
}

TEST(Config, ParsesTheGreyPatch) {
  EXPECT_FALSE(parse_config("camera { uri: \"sim:city\" }", "x")->grey_patch.has_value());
  const auto c = parse_config(
      "camera { uri: \"sim:city\" }\n"
      "grey_patch { lens: 1 x: 300 y: 200 width: 24 height: 16 normal: [0, 0.6, -0.8] albedo: 0.5 }",
      "x");
  ASSERT_TRUE(c.ok()) << c.status().message();
  ASSERT_TRUE(c->grey_patch.has_value());
  const GreyPatch& p = *c->grey_patch;
  EXPECT_EQ(p.lens, 1);
  EXPECT_EQ(p.x, 300);
  EXPECT_EQ(p.y, 200);
  EXPECT_EQ(p.width, 24);
  EXPECT_EQ(p.height, 16);
  EXPECT_EQ(p.normal, (Vec3f{0, 0.6F, -0.8F}));
  EXPECT_EQ(p.albedo, 0.5);
  const auto plain = parse_config("camera { uri: \"x:\" } grey_patch { width: 8 height: 8 }", "x");
  EXPECT_EQ(plain->grey_patch->normal, (Vec3f{0, 1, 0}));
  EXPECT_EQ(plain->grey_patch->albedo, 0.18);
  EXPECT_NE(refusal("camera { uri: \"x:\" } grey_patch { normal: [1, 0] }").find("grey_patch.normal"),
            std::string::npos);
}

TEST(Config, NobodyReceivesPicturesUnlessThatIsAskedFor) {
  const auto parsed = [](const std::string& text) {
    const Result<Config> c = parse_config("camera { uri: \"x:\" } " + text, "probe.textproto");
    EXPECT_TRUE(c.ok()) << c.status().message();
    return c.ok() ? *c : Config();
  };
  for (const char* text : {"", "images: IMAGE_RECIPIENTS_UNSPECIFIED", "images: IMAGE_RECIPIENTS_NOBODY"}) {
    EXPECT_EQ(parsed(text).images, ImageRecipients::nobody) << text;
    EXPECT_EQ(parsed(text).texture_recipients(), ImageRecipients::nobody) << text;
  }
  const Config all = parsed("images: IMAGE_RECIPIENTS_ALL_CLIENTS");
  EXPECT_EQ(all.images, ImageRecipients::all_clients);
  EXPECT_EQ(all.texture_recipients(), ImageRecipients::all_clients);
  EXPECT_TRUE(all.warnings.empty());
  EXPECT_NE(refusal("camera { uri: \"x:\" } images: 7").find("images is not known"), std::string::npos);
}

TEST(Config, TheFormerConsentToTheTextureIsNoConsentToOtherPictures) {
  const std::string start = "camera { uri: \"x:\" } plane { plane_file: \"book.textproto\" ";
  const auto parsed = [&](const std::string& text) {
    const Result<Config> c = parse_config(start + text, "probe.textproto");
    EXPECT_TRUE(c.ok()) << c.status().message();
    return c.ok() ? *c : Config();
  };
  const Config former = parsed("images: IMAGE_RECIPIENTS_ALL_CLIENTS }");
  EXPECT_EQ(former.texture_recipients(), ImageRecipients::all_clients);
  EXPECT_EQ(former.images, ImageRecipients::nobody);
  ASSERT_EQ(former.warnings.size(), 1U);
  EXPECT_NE(former.warnings[0].find("plane.images is deprecated"), std::string::npos);
  EXPECT_EQ(parsed("images: IMAGE_RECIPIENTS_NOBODY }").texture_recipients(), ImageRecipients::nobody);
  EXPECT_EQ(parsed("}").texture_recipients(), ImageRecipients::nobody);
  EXPECT_EQ(parsed("images: IMAGE_RECIPIENTS_ALL_CLIENTS } images: IMAGE_RECIPIENTS_NOBODY").texture_recipients(),
            ImageRecipients::nobody)
      << "`images` has precedence";
  EXPECT_NE(refusal(start + "images: 7 }").find("plane.images is not known"), std::string::npos);
}

TEST(Config, ClientsRecordNothingUnlessAFolderIsNamed) {
  const std::string camera = "camera { uri: \"x:\" } ";
  EXPECT_FALSE(parse_config(camera, "x")->recordings);
  const auto plain = parse_config(camera + "recordings { folder: \"r\" }", "x");
  ASSERT_TRUE(plain.ok()) << plain.status().message();
  EXPECT_EQ(plain->recordings->folder, "r");
  EXPECT_EQ(plain->recordings->max_bytes, 1'000'000'000U);
  EXPECT_EQ(plain->recordings->max_files, 100U);
  EXPECT_EQ(plain->recordings->min_free_bytes, 200'000'000U);
  const auto all =
      parse_config(camera + "recordings { folder: \"r\" max_bytes: 7 max_files: 8 min_free_bytes: 9 }", "x");
  ASSERT_TRUE(all.ok()) << all.status().message();
  EXPECT_EQ(all->recordings->max_bytes, 7U);
  EXPECT_EQ(all->recordings->max_files, 8U);
  EXPECT_EQ(all->recordings->min_free_bytes, 9U);
  EXPECT_NE(refusal(camera + "recordings {}").find("recordings.folder"), std::string::npos);
  EXPECT_NE(refusal(camera + "recordings { folder: \"r\" max_files: 10001 }").find("recordings.max_files"),
            std::string::npos);
}

/// The installed configuration file, unchanged and with each of its examples.
TEST(Config, InstalledFileAndItsExamplesAreValid) {
  const Result<Config> installed = load_config(LIGHTWELL_CONFIGURATION);
  ASSERT_TRUE(installed.ok()) << installed.status().message();
  EXPECT_EQ(installed->grpc.listen_address, "127.0.0.1:7420");
  std::ifstream file(LIGHTWELL_CONFIGURATION);
  int examples = 0;
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with("#:")) continue;
    ++examples;
    const std::string example = line.substr(2);
    const std::string camera = example.starts_with("camera") ? "" : "camera { uri: \"sim:city\" }\n";
    const Result<Config> read = parse_config(camera + example, "probe.textproto");
    EXPECT_TRUE(read.ok()) << read.status().message();
  }
  EXPECT_GE(examples, 5);
}

TEST(Config, PathsAreRelativeToTheFile) {
  const test::TempDir folder;
  const Result<Config> c =
      load_config(folder.write("probe.textproto",
                               "camera { uri: \"x:\" } calibration: \"rig.textproto\" mounting: \"/room.textproto\" "
                               "recordings { folder: \"evenings\" } "
                               "marker { body_file: \"b\" } mqtt { uri: \"mqtts://broker/a\" ca_file: \"ca.pem\" }"));
  ASSERT_TRUE(c.ok()) << c.status().message();
  EXPECT_EQ(c->calibration, folder.path("rig.textproto"));
  EXPECT_EQ(c->mounting, "/room.textproto");
  EXPECT_EQ(c->marker->body_file, folder.path("b"));
  EXPECT_EQ(c->recordings->folder, folder.path("evenings"));
  EXPECT_EQ(c->mqtt->ca_file, folder.path("ca.pem"));
  EXPECT_EQ(c->mqtt->login_file, "") << "no path";
}

TEST(Config, MissingFileIsNamed) {
  const auto c = load_config("/nonexistent/probe.textproto");
  EXPECT_EQ(c.status().code(), StatusCode::not_found);
  EXPECT_NE(c.status().message().find("/nonexistent/probe.textproto"), std::string::npos);
}

}  // namespace
}  // namespace lightwell
