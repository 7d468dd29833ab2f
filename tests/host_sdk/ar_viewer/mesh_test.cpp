#include "ar_viewer/mesh.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/temp_dir.hpp"

namespace lightwell::test {
namespace {

using testing::HasSubstr;

class BuiltInMesh : public testing::TestWithParam<const char*> {};

TEST_P(BuiltInMesh, StandsOnItsOriginAndItsNormalsAreThoseOfItsTriangles) {
  auto model = viewer::load_model(GetParam());
  ASSERT_TRUE(model.ok()) << model.status().message();
  viewer::scale_to(*model, {0.2});
  const viewer::Mesh& mesh = model->parts[0].mesh;
  Vec3f low{1, 1, 1}, high{-1, -1, -1};
  for (const viewer::Vertex& v : mesh.vertices) {
    low = {std::min(low.x, v.position.x), std::min(low.y, v.position.y), std::min(low.z, v.position.z)};
    high = {std::max(high.x, v.position.x), std::max(high.y, v.position.y), std::max(high.z, v.position.z)};
    ASSERT_NEAR(length(v.normal), 1, 1e-4);
    ASSERT_NEAR(v.normal.x * v.tangent[0] + v.normal.y * v.tangent[1] + v.normal.z * v.tangent[2], 0, 1e-3);
  }
  EXPECT_NEAR(low.y, 0, 1e-6);
  EXPECT_NEAR(low.x, -high.x, 1e-5);
  EXPECT_NEAR(std::max({high.x - low.x, high.y - low.y, high.z - low.z}), 0.2, 1e-5);
  int agree = 0, against = 0;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const auto& a = mesh.vertices[mesh.indices[i]];
    const auto& b = mesh.vertices[mesh.indices[i + 1]];
    const auto& c = mesh.vertices[mesh.indices[i + 2]];
    const Vec3f n = cross(b.position - a.position, c.position - a.position);
    if (length(n) < 1e-10F) continue;  // At a pole.
    (dot(n, a.normal + b.normal + c.normal) > 0 ? agree : against) += 1;
  }
  EXPECT_GT(agree, 10);
  // At the waist of the teapot's knob a triangle is larger than the curvature's radius.
  EXPECT_LT(100 * against, agree);
}

INSTANTIATE_TEST_SUITE_P(All, BuiltInMesh, testing::Values("sphere", "box", "cylinder", "teapot", "cloth"));

TEST(Mesh, OfTheTeapotEnclosesTheVolumeOfNewells) {
  // By the divergence theorem, which gives a positive volume if all triangles turn outwards. A cylinder of radius 1.8
  // and height 2.4, handle and spout have 26.
  const viewer::Mesh mesh = viewer::make_teapot(8);
  double six_volumes = 0;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const Vec3d a = vec_cast<double>(mesh.vertices[mesh.indices[i]].position);
    const Vec3d b = vec_cast<double>(mesh.vertices[mesh.indices[i + 1]].position);
    const Vec3d c = vec_cast<double>(mesh.vertices[mesh.indices[i + 2]].position);
    six_volumes += dot(a, cross(b, c));
  }
  const double scale = 0.3;
  EXPECT_NEAR(six_volumes / 6 / (scale * scale * scale), 26, 2);
}

TEST(Mesh, ScalesEachAxisAndItsNormals) {
  auto model = viewer::load_model("sphere");
  ASSERT_TRUE(model.ok());
  viewer::scale_to(*model, {0.1, 0.2, 0.4});
  for (const viewer::Vertex& v : model->parts[0].mesh.vertices) {
    const Vec3d p = vec_cast<double>(v.position) - Vec3d{0, 0.1, 0};
    const Vec3d gradient = normalized(Vec3d{p.x / 0.0025, p.y / 0.01, p.z / 0.04});
    ASSERT_LT(length(gradient - vec_cast<double>(v.normal)), 1e-3);
  }
}

/// A triangle of 2 m with a metal material, as a .glb.
std::string triangle_glb(std::uint32_t last_index) {
  const std::array<float, 9> positions = {0, 0, 0, 2, 0, 0, 0, 2, 0};
  const std::array<std::uint32_t, 3> indices = {0, 1, last_index};
  std::string binary(sizeof positions + sizeof indices, '\0');
  std::memcpy(binary.data(), positions.data(), sizeof positions);
  std::memcpy(binary.data() + sizeof positions, indices.data(), sizeof indices);
  std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"translation":[0,0,5]}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],)"
      R"("materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.9,0.6,0.3,1],)"
      R"("metallicFactor":1,"roughnessFactor":0.25}}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[2,2,0]},)"
      R"({"bufferView":1,"componentType":5125,"count":3,"type":"SCALAR"}],)"
      R"("bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":12}],)"
      R"("buffers":[{"byteLength":48}]})";
  while (json.size() % 4 != 0) json += ' ';
  const auto word = [](std::size_t value) {
    const auto v = static_cast<std::uint32_t>(value);
    std::string bytes(4, '\0');
    std::memcpy(bytes.data(), &v, 4);
    return bytes;
  };
  return "glTF" + word(2) + word(12 + 8 + json.size() + 8 + binary.size()) + word(json.size()) + "JSON" + json +
         word(binary.size()) + std::string("BIN\0", 4) + binary;
}

TEST(Mesh, OfAGlbHasItsTrianglesTransformAndMaterial) {
  const TempDir folder;
  const std::string path = folder.path("triangle.glb");
  std::ofstream(path, std::ios::binary) << triangle_glb(2);
  const auto model = viewer::load_model(path);
  ASSERT_TRUE(model.ok()) << model.status().message();
  ASSERT_EQ(model->parts.size(), 1U);
  EXPECT_EQ(model->parts[0].mesh.vertices[1].position, (Vec3f{2, 0, 5}));
  EXPECT_EQ(model->parts[0].mesh.vertices[1].normal, (Vec3f{0, 0, 1})) << "computed: the file has none";
  ASSERT_TRUE(model->parts[0].material.has_value());
  EXPECT_EQ(model->parts[0].material->metal_rough, 1.0F);
  EXPECT_EQ(model->parts[0].material->roughness, 0.25F);
  EXPECT_FLOAT_EQ(model->parts[0].material->base_color[1], 0.6F);
}

TEST(Mesh, OfADamagedGlbIsRefused) {
  const TempDir folder;
  const std::string path = folder.path("bad.glb");
  const auto refusal = [&](const std::string& bytes) {
    std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
    const auto model = viewer::load_model(path);
    return model.ok() ? std::string("accepted") : std::string(model.status().message());
  };
  EXPECT_THAT(refusal(triangle_glb(3)), testing::AllOf(HasSubstr("bad.glb"), HasSubstr("index is beyond")));
  const std::string whole = triangle_glb(2);
  for (std::size_t size = 0; size < whole.size(); size += 7)
    EXPECT_THAT(refusal(whole.substr(0, size)), HasSubstr("bad.glb")) << size;
  std::string beyond = whole;
  beyond.replace(beyond.find("\"byteOffset\":36"), 15, "\"byteOffset\":44");
  EXPECT_THAT(refusal(beyond), HasSubstr("bad.glb"));
  EXPECT_THAT(std::string(viewer::load_model(folder.path("none.glb")).status().message()), HasSubstr("none.glb"));
}

}  // namespace
}  // namespace lightwell::test
