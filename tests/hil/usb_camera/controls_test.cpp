#include "usb_camera/controls.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "usb_camera/descriptors.hpp"

namespace lightwell::usb_camera {
namespace {

constexpr std::uint8_t kMode = 0x02, kExposure = 0x04, kGain = 0x04, kWhite = 0x0A, kAutoWhite = 0x0B,
                       kPowerLine = 0x05;

/// A row of the table in controls.hpp.
struct Row {
  const char* name;
  std::uint8_t unit, selector;
  std::uint32_t length, min, max, res, def;
};
const std::vector<Row> kRows = {
    {"exposure", kCameraTerminal, kExposure, 4, 1, 10000, 1, 100},
    {"gain", kProcessingUnit, kGain, 2, 100, 400, 1, 100},
    {"white", kProcessingUnit, kWhite, 2, 2800, 8000, 10, 6500},
    {"auto white", kProcessingUnit, kAutoWhite, 1, 0, 1, 1, 1},
    {"power line", kProcessingUnit, kPowerLine, 1, 0, 2, 1, 0},
};

class ControlsTest : public ::testing::Test {
 protected:
  ControlReply ask(std::uint8_t unit, std::uint8_t selector, ControlRequest request) {
    return controls_.request(unit, selector, request, {});
  }
  std::uint32_t number(std::uint8_t unit, std::uint8_t selector, ControlRequest request) {
    const ControlReply reply = ask(unit, selector, request);
    EXPECT_TRUE(reply.ok());
    return get(reply.data, 0, 4);
  }
  RequestError set(std::uint8_t unit, std::uint8_t selector, std::uint32_t value, std::size_t length) {
    Bytes data;
    put(data, value, length);
    return controls_.request(unit, selector, ControlRequest::set_cur, data).error;
  }
  void all_manual() {
    EXPECT_EQ(set(kCameraTerminal, kMode, 1, 1), RequestError::none);
    EXPECT_EQ(set(kProcessingUnit, kAutoWhite, 0, 1), RequestError::none);
  }

  Controls controls_;
};

TEST_F(ControlsTest, ReportRangesAndDefaults) {
  for (const Row& row : kRows) {
    SCOPED_TRACE(row.name);
    EXPECT_EQ(number(row.unit, row.selector, ControlRequest::get_min), row.min);
    EXPECT_EQ(number(row.unit, row.selector, ControlRequest::get_max), row.max);
    EXPECT_EQ(number(row.unit, row.selector, ControlRequest::get_res), row.res);
    EXPECT_EQ(number(row.unit, row.selector, ControlRequest::get_def), row.def);
    EXPECT_EQ(number(row.unit, row.selector, ControlRequest::get_len), row.length);
    EXPECT_EQ(ask(row.unit, row.selector, ControlRequest::get_cur).data.size(), row.length);
    EXPECT_EQ(ask(row.unit, row.selector, ControlRequest::get_len).data.size(), 2U);
    EXPECT_EQ(number(row.unit, row.selector, ControlRequest::get_info) & 3, 3U) << "read and set";
  }
}

TEST_F(ControlsTest, AcceptTheirLimitsAndNothingBeyond) {
  all_manual();
  for (const Row& row : kRows) {
    SCOPED_TRACE(row.name);
    EXPECT_EQ(set(row.unit, row.selector, row.max, row.length), RequestError::none);
    EXPECT_EQ(number(row.unit, row.selector, ControlRequest::get_cur), row.max);
    EXPECT_EQ(set(row.unit, row.selector, row.max + row.res, row.length), RequestError::out_of_range);
    EXPECT_EQ(number(row.unit, row.selector, ControlRequest::get_cur), row.max) << "a rejected value changes nothing";
    if (row.selector == kAutoWhite) all_manual();
    EXPECT_EQ(set(row.unit, row.selector, row.min, row.length), RequestError::none);
    EXPECT_EQ(number(row.unit, row.selector, ControlRequest::get_cur), row.min);
    if (row.min > 0) {
      EXPECT_EQ(set(row.unit, row.selector, row.min - 1, row.length), RequestError::out_of_range);
    }
    EXPECT_EQ(set(row.unit, row.selector, row.min, row.length + 1), RequestError::invalid_request);
    EXPECT_EQ(set(row.unit, row.selector, row.min, row.length - 1), RequestError::invalid_request);
  }
  EXPECT_EQ(set(kProcessingUnit, kWhite, 2805, 2), RequestError::out_of_range) << "steps of 10";
}

TEST_F(ControlsTest, ModesAreOneBitOfThoseOffered) {
  EXPECT_EQ(number(kCameraTerminal, kMode, ControlRequest::get_res), 9U) << "manual and aperture priority";
  EXPECT_EQ(number(kCameraTerminal, kMode, ControlRequest::get_def), 8U);
  for (const std::uint32_t bad : {0U, 2U, 3U, 4U, 9U, 16U, 255U})
    EXPECT_EQ(set(kCameraTerminal, kMode, bad, 1), RequestError::out_of_range) << bad;
  EXPECT_EQ(ask(kCameraTerminal, kMode, ControlRequest::get_min).error, RequestError::invalid_request);
}

TEST_F(ControlsTest, ErrorsDistinguishUnitControlAndRequest) {
  EXPECT_EQ(ask(9, kGain, ControlRequest::get_cur).error, RequestError::invalid_unit);
  EXPECT_EQ(ask(kOutputTerminal, kGain, ControlRequest::get_cur).error, RequestError::invalid_unit);
  EXPECT_EQ(ask(kProcessingUnit, 0x02, ControlRequest::get_cur).error, RequestError::invalid_control);
  EXPECT_EQ(ask(kProcessingUnit, kGain, static_cast<ControlRequest>(0x99)).error, RequestError::invalid_request);
}

TEST_F(ControlsTest, AutomaticControlsCannotBeSet) {
  controls_.set_automatic(0.0023, 1.0 / 30);
  EXPECT_EQ(set(kCameraTerminal, kExposure, 50, 4), RequestError::wrong_state);
  EXPECT_EQ(number(kCameraTerminal, kExposure, ControlRequest::get_info), 0x0FU)
      << "disabled, and it changes by itself";
  EXPECT_EQ(number(kCameraTerminal, kExposure, ControlRequest::get_cur), 23U) << "the automatically chosen value";
  EXPECT_DOUBLE_EQ(controls_.settings().exposure_s, 0.0023);
  EXPECT_EQ(set(kProcessingUnit, kWhite, 5000, 2), RequestError::wrong_state);
  EXPECT_EQ(controls_.settings().kelvin, 6500);
  all_manual();
  EXPECT_EQ(number(kCameraTerminal, kExposure, ControlRequest::get_cur), 23U) << "the automatic value is kept";
  EXPECT_EQ(number(kCameraTerminal, kExposure, ControlRequest::get_info), 0x0BU);
  EXPECT_EQ(set(kCameraTerminal, kExposure, 3, 4), RequestError::none);
  EXPECT_EQ(controls_.settings().exposure_s, 0.0003) << "exactly the double 0.0003";
  EXPECT_EQ(set(kProcessingUnit, kWhite, 5000, 2), RequestError::none);
  EXPECT_EQ(controls_.settings().kelvin, 5000);
}

TEST_F(ControlsTest, AutomaticExposureFollowsGainAndFrameTime) {
  controls_.set_automatic(0.02, 0.01);
  EXPECT_DOUBLE_EQ(controls_.settings().exposure_s, 0.01);
  EXPECT_EQ(set(kProcessingUnit, kGain, 400, 2), RequestError::none);
  EXPECT_DOUBLE_EQ(controls_.settings().exposure_s, 0.005);
  EXPECT_DOUBLE_EQ(controls_.settings().gain, 4);
}

TEST_F(ControlsTest, AutomaticExposureIsAMultipleOfTheFlickerPeriod) {
  controls_.set_automatic(0.027, 1.0 / 30);
  EXPECT_EQ(set(kProcessingUnit, kPowerLine, 1, 1), RequestError::none);
  EXPECT_DOUBLE_EQ(controls_.settings().exposure_s, 0.02);
  EXPECT_EQ(set(kProcessingUnit, kPowerLine, 2, 1), RequestError::none);
  EXPECT_DOUBLE_EQ(controls_.settings().exposure_s, 3.0 / 120);
  controls_.set_automatic(0.004, 1.0 / 30);
  EXPECT_DOUBLE_EQ(controls_.settings().exposure_s, 0.004) << "shorter than one flicker period";
}

TEST_F(ControlsTest, BitmapsHaveTheSupportedControls) {
  EXPECT_EQ(control_bitmap(kCameraTerminal), 1U << 1 | 1U << 3);
  EXPECT_EQ(control_bitmap(kProcessingUnit), 1U << 6 | 1U << 9 | 1U << 10 | 1U << 12);
}

TEST_F(ControlsTest, ResetRestoresThePowerOnState) {
  all_manual();
  EXPECT_EQ(set(kProcessingUnit, kGain, 300, 2), RequestError::none);
  EXPECT_EQ(controls_.sets(), 3U);
  controls_.reset();
  EXPECT_EQ(controls_.settings().gain, 1);
  EXPECT_EQ(number(kCameraTerminal, kMode, ControlRequest::get_cur), 8U);
}

}  // namespace
}  // namespace lightwell::usb_camera
