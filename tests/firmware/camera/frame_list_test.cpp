#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "camera/backends/replay/source.hpp"

namespace lightwell::replay {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::string kHead = "file,lens,exposure_s,time_s,bracket_index,bracket_size\n";

TEST(FrameList, RowsWithTheSameTimeAndExposureAreOneFrame) {
  const auto frames = parse_frame_list(kHead +
                                           "a0.png,0,0.001,10,0,2\n"
                                           "a1.png,1,0.001,10,0,2\r\n"
                                           "\n"
                                           "b0.png, 0, 0.008, 10.05, 1, 2\n"
                                           "b1.png,1,8e-3,10.05,1,2",
                                       "frames.csv");
  ASSERT_TRUE(frames.ok()) << frames.status().message();
  ASSERT_EQ(frames->size(), 2U);
  EXPECT_THAT((*frames)[0].files, ElementsAre("a0.png", "a1.png"));
  EXPECT_THAT((*frames)[1].files, ElementsAre("b0.png", "b1.png"));
  const FrameInfo& second = (*frames)[1].info;
  EXPECT_EQ(second.sequence, 1U);
  EXPECT_DOUBLE_EQ(second.exposure_s, 0.008);
  EXPECT_EQ(second.bracket_index, 1);
  EXPECT_EQ(second.bracket_size, 2);
  EXPECT_NEAR((second.mid_exposure - (*frames)[0].info.mid_exposure).seconds(), 0.05, 1e-6);
}

TEST(FrameList, ColumnsComeInAnyOrderAndSomeMayBeAbsent) {
  const auto frames = parse_frame_list("time_s,gain,file,exposure_s\n0,2,a.png,0.01\n", "x");
  ASSERT_TRUE(frames.ok()) << frames.status().message();
  EXPECT_EQ((*frames)[0].info.gain, 2);
  EXPECT_EQ((*frames)[0].info.bracket_size, 1);
}

TEST(FrameList, ErrorsNameTheLine) {
  const struct {
    std::string text;
    std::string said;
  } cases[] = {
      {"", "x: no frame"},
      {kHead, "x: no frame"},
      {"file,lens,exposure\n", "x:1: unknown column 'exposure'"},
      {"file,exposure_s,time\n", "x:1: unknown column 'time'; did you mean 'time_s'?"},
      {"file,exposure_s\n", "x:1: column time_s is missing in the first line"},
      {"file,file\n", "x:1: column file is listed twice"},
      {kHead + "a,0,1,0,0,1\nb,0,1,1,0\n", "x:3: 5 cells, where the first line names 6"},
      {kHead + "a,0,long,0,0,1\n", "x:2: exposure_s: 'long' is not a number"},
      {kHead + "a,0,nan,0,0,1\n", "x:2: exposure_s: 'nan' is not a number"},
      {kHead + "a,0,0,0,0,1\n", "x:2: exposure_s must be positive"},
      {kHead + ",0,1,0,0,1\n", "x:2: no file"},
      {kHead + "a,2,1,0,0,1\n", "x:2: lens must be 0 or 1"},
      {kHead + "a,1,1,0,0,1\n", "x:2: lens 1 where lens 0"},
      {kHead + "a,0,1,0,0,1\nb,0,1,0,0,1\n", "x:3: lens 0 where lens 1"},
      {kHead + "a,0,1,0,0,9\n", "x:2: bracket_size must be 1 to 8"},
      {kHead + "a,0,1,0,2,2\n", "x:2: bracket_index must be"},
      {kHead + "a,0,1,-1,0,1\n", "x:2: time_s must be"},
      {kHead + "a,0,1,2,0,1\nb,0,1,1,0,1\n", "x:3: time_s must grow"},
      {kHead + "a,0,1,0,0,1\nb,1,1,0,0,1\nc,0,1,1,0,1\n", "x:4: the frame above has 1 lenses"},
      {kHead + "a,0,1,0,0,1\nb,0,1,1,0,2\n", "x:3: the frame above has another bracket_size"},
  };
  for (const auto& c : cases) {
    const auto frames = parse_frame_list(c.text, "x");
    ASSERT_FALSE(frames.ok()) << c.text;
    EXPECT_EQ(frames.status().code(), StatusCode::invalid_argument);
    EXPECT_THAT(frames.status().message(), HasSubstr(c.said));
  }
}

}  // namespace
}  // namespace lightwell::replay
