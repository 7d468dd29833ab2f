// make_backend(): selection of a backend by the URI, and its errors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "app/component_tables.hpp"

namespace lightwell {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

Status refusal(const std::string& uri) {
  CameraConfig config;
  config.uri = uri;
  const Result<std::unique_ptr<CameraBackend>> made = make_backend(config);
  EXPECT_FALSE(made.ok()) << uri;
  return made.status();
}

TEST(BackendTable, ListsTheBackendsOfThisBuild) {
  for (const BackendEntry& entry : backend_table()) {
    EXPECT_THAT(std::string(entry.help), HasSubstr(std::string(entry.scheme) + ":"));
    EXPECT_NE(entry.make, nullptr);
  }
}

TEST(BackendTable, AnUnknownSchemeNamesTheNearestAndAllKnownOnes) {
  const Status s = refusal("sin:city");
  EXPECT_EQ(s.code(), StatusCode::not_found);
  EXPECT_THAT(s.message(), HasSubstr("'sin:city'"));
  EXPECT_THAT(s.message(), HasSubstr("did you mean 'sim'?"));
  for (const BackendEntry& entry : backend_table()) EXPECT_THAT(s.message(), HasSubstr(std::string(entry.scheme)));
}

TEST(BackendTable, WithoutASimilarNameNothingIsSuggested) {
  EXPECT_THAT(refusal("thermometer:attic").message(), Not(HasSubstr("did you mean")));
}

TEST(BackendTable, AUriWithoutASchemeIsRefused) { EXPECT_EQ(refusal("city").code(), StatusCode::invalid_argument); }

TEST(BackendTable, AnUnknownParameterNamesTheNearest) {
  const Status s = refusal("sim:city?sensr=rgb8");
  EXPECT_EQ(s.code(), StatusCode::invalid_argument);
  EXPECT_THAT(s.message(), HasSubstr("sensr"));
  EXPECT_THAT(s.message(), HasSubstr("sensor"));
}

TEST(BackendTable, AKnownSchemeMakesACamera) {
  CameraConfig config;
  config.uri = "sim:city?sensor=rgb8";
  EXPECT_TRUE(make_backend(config).ok()) << "a missing panorama is an error of open() only";
}

}  // namespace
}  // namespace lightwell
