// make_estimator(): selection of an estimator by the configuration, and its errors.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "app/component_tables.hpp"

namespace lightwell {
namespace {

TEST(EstimatorTable, HasEveryKind) {
  for (const EstimatorKind kind : kEstimatorKinds)
    EXPECT_EQ(std::ranges::count(estimator_table(), kind, &EstimatorEntry::kind), 1) << to_string(kind);
}

TEST(EstimatorTable, TheConfiguredEstimatorIsMade) {
  Config config;
  config.estimator_kind = EstimatorKind::marker;
  config.marker = MarkerConfig{"/nonexistent/body.textproto"};
  const Status bodiless = make_estimator(config, {}, {}).status();
  EXPECT_EQ(bodiless.code(), StatusCode::not_found);
  EXPECT_THAT(bodiless.message(), ::testing::HasSubstr("/nonexistent/body.textproto"));
  config.budget_ms = 5;
  EXPECT_THAT(make_estimator(config, {}, {}).status().message(), ::testing::HasSubstr("no cheaper setting"));
  config.budget_ms = 0;
  config.max_bound = 0.02;
  EXPECT_THAT(make_estimator(config, {}, {}).status().message(), ::testing::HasSubstr("max_bound: the marker"));

  config = {};
  config.estimator_kind = EstimatorKind::specular;
  config.plane = PlaneConfig{"/nonexistent/plane.textproto"};
  const Status planeless = make_estimator(config, {}, {}).status();
  EXPECT_EQ(planeless.code(), StatusCode::not_found);
  EXPECT_THAT(planeless.message(), ::testing::HasSubstr("/nonexistent/plane.textproto"));
  config.budget_ms = 5;
  EXPECT_THAT(make_estimator(config, {}, {}).status().message(), ::testing::HasSubstr("no cheaper setting"));
}

}  // namespace
}  // namespace lightwell
