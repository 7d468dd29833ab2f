// Options of the estimators: in the configuration, as changes, and as text.
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/config.hpp>

namespace lightwell {
namespace {

std::string refusal(std::string_view text) {
  const auto c = parse_config(text, "probe.textproto");
  EXPECT_FALSE(c.ok());
  return c.status().message();
}

TEST(EstimatorConfig, SettingScalesTheErrorTolerances) {
  EstimatorConfig c;
  c.panorama.epsilon = 0.01;
  c.panorama.radiance_epsilon = 0.05;
  c.setting = Setting::balanced;
  EXPECT_EQ(config_for_setting(c).panorama.epsilon, 0.01);
  EXPECT_EQ(config_for_setting(c).panorama.radiance_epsilon, 0.05);
  c.setting = Setting::fast;
  EXPECT_EQ(config_for_setting(c).panorama.epsilon, 0.02);
  EXPECT_EQ(config_for_setting(c).panorama.radiance_epsilon, 0.1);
  EXPECT_EQ(config_for_setting(c).setting, Setting::fast);
  EXPECT_EQ(config_for_setting(c).panorama.interleave, 1);
  c.setting = Setting::fastest;
  EXPECT_EQ(config_for_setting(c).panorama.epsilon, 0.02);
  EXPECT_EQ(config_for_setting(c).panorama.radiance_epsilon, 0.1);
  EXPECT_EQ(config_for_setting(c).panorama.interleave, kMaxInterleave);
  c.setting = Setting::exact;
  EXPECT_EQ(config_for_setting(c).panorama.interleave, 1);
  EXPECT_EQ(config_for_setting(c).panorama.epsilon, 0);
  EXPECT_EQ(config_for_setting(c).panorama.radiance_epsilon, 0);
}

TEST(EstimatorConfig, ExplicitZeroIsKept) {
  const auto c = parse_config("camera { uri: \"sim:city\" } estimator { band: 0 max_lights: 0 }", "x");
  ASSERT_TRUE(c.ok());
  EXPECT_EQ(c->estimator.band, 0);
  EXPECT_EQ(c->estimator.max_lights, 0);
}

TEST(EstimatorConfig, FormerNameOfAnOptionSetsTheCurrentOne) {
  EstimatorUpdate update;
  EXPECT_TRUE(set_field(update, "panorama.unseen", "mirror").ok());
  EXPECT_EQ(update.panorama.unseen, UnseenFill::mirror);
  EXPECT_EQ(current_option_name("panorama.unseen"), "panorama.unseen_fill");
  for (const char* other : {"panorama.epsilon", "marker.unseen", "unseen", "panorama.", "."})
    EXPECT_EQ(current_option_name(other), other);
}

TEST(EstimatorConfig, UpdateChangesOnlyItsFields) {
  EstimatorConfig c;
  c.band = 1;
  c.panorama.unseen = UnseenFill::average;
  EstimatorConfig expected = c;
  expected.panorama.epsilon = 0.02;
  EXPECT_EQ(updated(c, {.panorama = {.epsilon = 0.02}}), expected);
  EXPECT_EQ(updated(c, {}), c);
  EXPECT_EQ(updated({}, all_fields(c)), c);
}

TEST(EstimatorConfig, FieldsRoundTripThroughText) {
  EstimatorConfig c;
  c.band = 2;
  c.setting = Setting::fast;
  c.panorama.epsilon = 0.1 + 0.2;
  c.panorama.smoothing = Smoothing::none;
  c.panorama.interleave = 8;
  c.panorama.max_bytes = 128;
  c.marker.max_faces = 3;
  c.specular.environment_edge = 64;
  EstimatorUpdate read;
  for (const EstimatorKind kind : kEstimatorKinds) {
    const std::vector<ConfigField> fields = fields_of({kind, c});
    for (const ConfigField& f : fields) {
      const Status s = set_field(read, f.name, f.value);
      EXPECT_TRUE(s.ok()) << s.message();
      EstimatorUpdate alone;
      (void)set_field(alone, f.name, f.value);
      EXPECT_NE(alone, EstimatorUpdate{}) << f.name << " has no row in kOptions";
    }
  }
  EXPECT_EQ(read, all_fields(c)) << "not a bit is lost";
}

TEST(EstimatorConfig, UnknownFieldIsRejectedWithTheNearestName) {
  EstimatorUpdate update;
  const auto refusal = [&](std::string_view name, std::string_view value) {
    const Status s = set_field(update, name, value);
    EXPECT_EQ(s.code(), StatusCode::invalid_argument) << name << "=" << value;
    return s.message();
  };
  EXPECT_NE(refusal("epsilon", "0.02").find("did you mean 'panorama.epsilon'"), std::string::npos);
  EXPECT_NE(refusal("panorama.epsilom", "0.02").find("did you mean 'panorama.epsilon'"), std::string::npos);
  EXPECT_NE(refusal("panorama", "1").find("there is no field"), std::string::npos);
  for (const std::string_view name : {"", ".", "panorama.", ".band", "panorama.epsilon.x", "xpanorama.epsilon"})
    EXPECT_NE(refusal(name, "1").find("there is no field"), std::string::npos);
  EXPECT_NE(refusal("setting", "quick").find("one of fast, balanced, exact, fastest"), std::string::npos);
  EXPECT_NE(refusal("setting", "unspecified").find("one of fast"), std::string::npos);
  EXPECT_NE(refusal("band", "2.5").find("a whole number"), std::string::npos);
  EXPECT_NE(refusal("band", "-1").find("a whole number"), std::string::npos);
  EXPECT_NE(refusal("panorama.epsilon", "0,02").find("a number"), std::string::npos);
  EXPECT_NE(refusal("panorama.epsilon", "").find("a number"), std::string::npos);
  EXPECT_EQ(update, EstimatorUpdate{}) << "and nothing changed";
}

TEST(EstimatorConfig, EstimatorOptionsAreInTheirOwnMessage) {
  const auto c = parse_config(
      "camera { uri: \"x:\" } estimator { band: 3 panorama { epsilon: 0.02 unseen_fill: UNSEEN_FILL_MIRROR } }", "x");
  ASSERT_TRUE(c.ok()) << c.status().message();
  EXPECT_EQ(c->estimator.band, 3);
  EXPECT_EQ(c->estimator.panorama.epsilon, 0.02);
  EXPECT_EQ(c->estimator.panorama.unseen, UnseenFill::mirror);
  EXPECT_TRUE(c->warnings.empty());
  const auto m = parse_config(
      "camera { uri: \"x:\" } marker { body_file: \"b\" } estimator { marker { decimation: 2 max_faces: 3 } }", "x");
  ASSERT_TRUE(m.ok()) << m.status().message();
  EXPECT_EQ(m->estimator.marker.decimation, 2);
  EXPECT_EQ(m->estimator.marker.max_faces, 3);
  const auto s = parse_config(
      "camera { uri: \"x:\" } plane { plane_file: \"p\" } estimator { specular { environment_edge: 64 } }", "x");
  ASSERT_TRUE(s.ok()) << s.status().message();
  EXPECT_EQ(s->estimator.specular.environment_edge, 64);
  EXPECT_EQ(s->estimator.panorama.environment_edge, 0);
}

TEST(EstimatorConfig, DeprecatedFieldsMeanThePanoramasAndWarn) {
  const std::string old =
      "camera { uri: \"x:\" } estimator { light_threshold: 9 epsilon: 0.03 radiance_epsilon: 0.1 unseen: "
      "UNSEEN_FILL_AVERAGE smoothing: SMOOTHING_NONE environment_edge: 16 environment_rate: 2 ";
  const auto c = parse_config(old + "}", "probe.textproto");
  ASSERT_TRUE(c.ok()) << c.status().message();
  const PanoramaEstimatorConfig meant{9, 0.03, 0.1, UnseenFill::average, Smoothing::none, 16, 2};
  EXPECT_EQ(c->estimator.panorama, meant);
  ASSERT_EQ(c->warnings.size(), 7U);
  EXPECT_EQ(c->warnings[1],
            "probe.textproto: estimator.epsilon is deprecated; write estimator { panorama { epsilon } }");
  EXPECT_EQ(parse_config(old + "panorama { epsilon: 0.04 } }", "x")->estimator.panorama.epsilon, 0.04)
      << "the new spelling has precedence";
}

TEST(EstimatorConfig, DeprecatedFieldsDoNothingForAMarkerAndSaySo) {
  const std::string text = "camera { uri: \"x:\" } estimator { epsilon: 0.03 }";
  const auto c = parse_config(text, "x", {}, EstimatorKind::marker);
  ASSERT_TRUE(c.ok()) << c.status().message();
  EXPECT_EQ(c->estimator, EstimatorConfig{});
  ASSERT_EQ(c->warnings.size(), 1U);
  EXPECT_NE(c->warnings[0].find("estimator.epsilon has no effect"), std::string::npos) << c->warnings[0];
}

TEST(EstimatorConfig, AnOptionOfAnotherEstimatorIsRefusedByName) {
  const std::string marker =
      refusal("camera { uri: \"x:\" } marker { body_file: \"b\" } estimator { panorama { environment_edge: 16 } }");
  EXPECT_NE(marker.find("estimator.panorama.environment_edge: the marker estimator"), std::string::npos) << marker;
  EXPECT_NE(marker.find("--estimator panorama"), std::string::npos) << marker;
  const std::string panorama = refusal("camera { uri: \"x:\" } estimator { marker { max_faces: 2 } }");
  EXPECT_NE(panorama.find("estimator.marker.max_faces: the panorama estimator"), std::string::npos) << panorama;
  EXPECT_NE(refusal("camera { uri: \"x:\" } marker { body_file: \"b\" } estimator { setting: SETTING_FAST }")
                .find("estimator.setting: the marker estimator has no setting fast"),
            std::string::npos);
  const std::string specular =
      refusal("camera { uri: \"x:\" } plane { plane_file: \"p\" } estimator { panorama { environment_edge: 64 } }");
  EXPECT_NE(specular.find("estimator.panorama.environment_edge: the specular estimator"), std::string::npos)
      << specular;
  const std::string edge = refusal("camera { uri: \"x:\" } estimator { specular { environment_edge: 64 } }");
  EXPECT_NE(edge.find("estimator.specular.environment_edge: the panorama estimator"), std::string::npos) << edge;
  const std::string size =
      refusal("camera { uri: \"x:\" } plane { plane_file: \"p\" } estimator { specular { environment_edge: 7 } }");
  EXPECT_NE(size.find("specular.environment_edge"), std::string::npos) << size;
  for (const EstimatorKind kind : kEstimatorKinds)
    EXPECT_TRUE(EstimatorConfig{}.validate(kind).ok()) << "defaults need no option";
}

TEST(EstimatorConfig, AnEstimatorAnswersWhichOptionsItHas) {
  std::vector<std::string> names;
  for (const ConfigField& field : fields_of({EstimatorKind::marker, {}})) names.push_back(field.name);
  EXPECT_EQ(names, (std::vector<std::string>{"band", "max_lights", "setting", "marker.decimation",
                                             "marker.search_decimation", "marker.max_faces"}));
  EXPECT_EQ(fields_of({EstimatorKind::panorama, {}}).size(), 12U);
  names.clear();
  for (const ConfigField& field : fields_of({EstimatorKind::specular, {}})) names.push_back(field.name);
  EXPECT_EQ(names, (std::vector<std::string>{"band", "max_lights", "setting", "specular.environment_edge"}));
}

}  // namespace
}  // namespace lightwell
