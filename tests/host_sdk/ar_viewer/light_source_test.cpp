// Light from files and from a replayed probe.
#include "ar_viewer/light_source.hpp"

#include <chrono>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/codec.hpp>
#include <lightwell/recording.hpp>

#include "ar_viewer/headless_context.hpp"
#include "ar_viewer/viewer.hpp"
#include "host_sdk/ar_viewer/viewer_scenes.hpp"
#include "support/temp_dir.hpp"

namespace lightwell::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// One light, at the azimuth of the number.
Descriptor numbered_light(int number) {
  Descriptor d = uniform_light({0.2F, 0.2F, 0.2F});
  d.sequence = static_cast<std::uint64_t>(number + 1);
  d.time.mid_exposure.ns = 1'000'000'000LL + 33'000'000LL * number;
  d.lights = {make_light({0.1F + static_cast<float>(number), 2, 1}, {2, 2, 2}, 1)};
  d.probe_id = 1;
  return d;
}

class ViewerLightSource : public testing::Test {
 protected:
  /// A recording of so many descriptors.
  std::string record(int count) {
    std::string path = folder.path("light.lwr");
    auto writer = RecordWriter::open(path, {RecordingKind::descriptors, "probe", "1", {}});
    EXPECT_TRUE(writer.ok());
    Encoder encoder;
    for (int i = 0; i < count; ++i) {
      const auto bytes = encoder.encode(numbered_light(i));
      EXPECT_TRUE(bytes.ok()) << bytes.status().message();
      EXPECT_TRUE(writer->append(1'000'000'000LL + 33'000'000LL * i, *bytes).ok());
    }
    EXPECT_TRUE(writer->flush().ok());
    return path;
  }
  static std::string error_of(const std::string& path) {
    const auto source = viewer::open_light_source(viewer::LightFile{path});
    return source.ok() ? std::string("accepted") : std::string(source.status().message());
  }

  TempDir folder;
};

TEST_F(ViewerLightSource, GivesOneDescriptorOfARecordingAFrame) {
  auto source = viewer::open_light_source(viewer::LightFile{record(3)});
  ASSERT_TRUE(source.ok()) << source.status().message();
  for (const int number : {0, 1, 2, 2, 2}) {
    const Lighting light = (*source)->next();
    EXPECT_EQ(light.validity(), Validity::valid);
    ASSERT_EQ(light.lights().size(), 1U);
    EXPECT_LT(angle_between(light.lights()[0].direction, numbered_light(number).lights[0].direction), 1e-3) << number;
  }
}

TEST_F(ViewerLightSource, ReadsAnEncodedDescriptor) {
  Encoder encoder;
  const auto bytes = encoder.encode(numbered_light(4));
  ASSERT_TRUE(bytes.ok());
  const std::string path = folder.path("light.descriptor");
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes->data()), static_cast<std::streamsize>(bytes->size()));  // NOLINT
  auto source = viewer::open_light_source(viewer::LightFile{path});
  ASSERT_TRUE(source.ok()) << source.status().message();
  const Lighting light = (*source)->next();
  EXPECT_EQ(light.validity(), Validity::valid);
  EXPECT_LT(angle_between(light.lights()[0].direction, numbered_light(4).lights[0].direction), 1e-3);
}

TEST_F(ViewerLightSource, RefusesOtherFiles) {
  const std::string path = folder.path("other");
  EXPECT_THAT(error_of(path), AllOf(HasSubstr("other"), HasSubstr("cannot be opened")));
  std::ofstream(path) << "no light";
  EXPECT_THAT(error_of(path), AllOf(HasSubstr("other"), HasSubstr("neither a recording nor a descriptor")));
  std::ofstream(path) << std::string(1'000'000, 'x');
  EXPECT_THAT(error_of(path), AllOf(HasSubstr("other"), HasSubstr("bytes")));
  EXPECT_THAT(error_of(folder.path(".")), HasSubstr("cannot be opened"));
  const std::string frames = folder.path("frames.lwr");
  ASSERT_TRUE(RecordWriter::open(frames, {RecordingKind::frames, "probe", "1", {}})->flush().ok());
  EXPECT_THAT(error_of(frames), AllOf(HasSubstr("frames.lwr"), HasSubstr("lightwell record")));
  EXPECT_FALSE(viewer::open_light_source(viewer::LightUri{"replay:" + path}).ok());
}

TEST_F(ViewerLightSource, ThatBecomesStaleLosesItsShadow) {
  viewer::Scene scene = make_viewer_scene();
  scene.lights["light"] = viewer::LightUri{"replay:" + record(1)};
  scene.ground = viewer::Ground{};
  scene.objects = {make_object("box", {0.02, 0.078, 0.02})};
  scene.shadow.stale_fade_s = 0.5;
  // In the middle of the lamp's shadow, behind the box.
  const PixelPoint at = pixel_of(scene, {0, 0, -0.03});
  // The lamp gives the plane three times the irradiance of the residual.
  viewer::Scene valid = scene;
  set_light(valid, numbered_light(0));
  EXPECT_LT(render(valid).shadow.at(static_cast<int>(at.column), static_cast<int>(at.row))[1], 0.3F);
  const auto context = viewer::HeadlessContext::make();
  ASSERT_TRUE(context.ok()) << context.status().message();
  auto made = viewer::Viewer::make(scene);
  ASSERT_TRUE(made.ok()) << made.status().message();
  const auto ratio = [&] {
    viewer::Picture shadow;
    EXPECT_TRUE(made->draw_shadow().ok());
    made->renderer().target().read(shadow);
    return shadow.at(static_cast<int>(at.column), static_cast<int>(at.row))[1];
  };
  float last = 0;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (last < 0.6F && std::chrono::steady_clock::now() < end) {
    const auto report = made->draw_next();
    ASSERT_TRUE(report.ok());
    last = ratio();
    EXPECT_TRUE(last <= 0.3F || report->validity == Validity::stale) << last;
  }
  EXPECT_GT(last, 0.6F) << "occlusion alone is left";
}

TEST(ViewerAnchor, AnObjectStandsOnTheMarkersBody) {
  viewer::Scene scene = make_viewer_scene();
  scene.T_world_probe = Pose{Quat::about({0, 1, 0}, 0.4), {0.02, 0.01, -0.03}};
  Descriptor d = uniform_light({1, 1, 1});
  d.T_probe_origin = {Quat::about({0, 0, 1}, 0.3), {0.05, 0.02, -0.01}};
  set_light(scene, d);
  viewer::Object object = make_object("sphere", {0.04});
  object.anchor = viewer::Anchor::marker_body;
  object.T_anchor_object.translation = {0.01, 0.02, 0.03};
  scene.objects = {object};
  const Rendered picture = render(scene);
  // The sphere's middle is half its height above its origin.
  const Vec3d middle = transformed(compose(*scene.T_world_probe, d.T_probe_origin), Vec3d{0.01, 0.04, 0.03});
  const PixelPoint expected = pixel_of(scene, middle);
  double columns = 0, rows = 0, count = 0;
  for (int row = 0; row < 360; ++row)
    for (int column = 0; column < 640; ++column)
      if (picture.frame.at(column, row)[3] > 0.5F) {
        columns += column;
        rows += row;
        ++count;
      }
  ASSERT_GT(count, 500);
  // The outline of a sphere is an ellipse whose centre is beside the image of the middle by less than a pixel here.
  EXPECT_NEAR(columns / count, expected.column, 1);
  EXPECT_NEAR(rows / count, expected.row, 1);
}

}  // namespace
}  // namespace lightwell::test
