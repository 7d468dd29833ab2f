#include <limits>

#include <gtest/gtest.h>

#include <lightwell/calibration.hpp>

namespace lightwell {
namespace {

std::string refusal(std::string_view text) {
  const Result<UncertainPose> mounting = parse_mounting(text, "room.textproto");
  EXPECT_FALSE(mounting.ok()) << text;
  return mounting.status().message();
}

TEST(Mounting, RoundTrips) {
  UncertainPose hangs{{Quat::about({0, 1, 0}, 0.7), {1, 2.5, -3}}, {}};
  for (std::size_t i = 0; i < 6; ++i) hangs.covariance[i][i] = 1e-6 * static_cast<double>(i + 1);
  hangs.covariance[0][4] = hangs.covariance[4][0] = -1e-6;
  const Result<UncertainPose> back = parse_mounting(mounting_to_text(hangs), "x");
  ASSERT_TRUE(back.ok()) << back.status().message();
  EXPECT_EQ(back->covariance, hangs.covariance);
  EXPECT_EQ(back->pose.translation, hangs.pose.translation);
  EXPECT_NEAR(back->pose.rotation.y, hangs.pose.rotation.y, 1e-15) << "it is normalised";
}

TEST(Mounting, UnknownHeadingStaysInfinite) {
  UncertainPose up{};
  constexpr double kInf = std::numeric_limits<double>::infinity();
  for (const std::size_t i : {1U, 3U, 4U, 5U}) up.covariance[i][i] = kInf;
  const Result<UncertainPose> back = parse_mounting(mounting_to_text(up), "x");
  ASSERT_TRUE(back.ok()) << back.status().message();
  EXPECT_EQ(*back, up);
}

TEST(Mounting, WithoutCovarianceIsExact) {
  const Result<UncertainPose> back = parse_mounting("pose { qx: 3 qw: 4 ty: 2 }", "x");
  ASSERT_TRUE(back.ok()) << back.status().message();
  EXPECT_EQ(back->pose.rotation, (Quat{0.6, 0, 0, 0.8}));
  EXPECT_EQ(back->covariance, PoseCovariance{});
}

TEST(Mounting, RejectsInvalidValuesNamingTheField) {
  EXPECT_EQ(refusal("pose { qq: 1 }").find("room.textproto:1"), 0U);
  EXPECT_NE(refusal("").find("qx, qy, qz, qw"), std::string::npos);
  EXPECT_NE(refusal("pose { qw: nan }").find("qx, qy, qz, qw"), std::string::npos);
  EXPECT_NE(refusal("pose { qw: 1 tx: inf }").find("tx, ty, tz"), std::string::npos);
  EXPECT_NE(refusal("pose { qw: 1 } covariance: [1, 2, 3]").find("21"), std::string::npos);
  const auto with = [](const std::string& first, const std::string& second) {
    std::string list = first + ", " + second;
    for (int i = 2; i < 21; ++i) list += ", 1";
    return "pose { qw: 1 } covariance: [" + list + "]";
  };
  EXPECT_TRUE(parse_mounting(with("1", "1"), "x").ok());
  EXPECT_NE(refusal(with("-1", "0")).find("variance 0"), std::string::npos);
  EXPECT_NE(refusal(with("nan", "0")).find("variance 0"), std::string::npos);
  EXPECT_NE(refusal(with("1", "1.1")).find("of 0 and 1"), std::string::npos);
  EXPECT_NE(refusal(with("1", "nan")).find("of 0 and 1"), std::string::npos);
  EXPECT_NE(refusal(with("inf", "1")).find("with an infinite variance"), std::string::npos);
}

}  // namespace
}  // namespace lightwell
