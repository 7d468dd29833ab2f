#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include <lightwell/bytes.hpp>
#include <lightwell/calibration.hpp>
#include <lightwell/frame_record.hpp>
#include <lightwell/recording.hpp>

#include "support/temp_dir.hpp"

namespace lightwell {
namespace {

class Recording : public testing::Test {
 protected:
  static std::vector<std::byte> bytes(const std::string& s) {
    const auto b = std::as_bytes(std::span(s));
    return {b.begin(), b.end()};
  }
  void write(const std::vector<std::string>& payloads) {
    auto writer = RecordWriter::open(path_, {RecordingKind::descriptors, "probe", "1", std::nullopt});
    ASSERT_TRUE(writer.ok()) << writer.status().message();
    for (const std::string& p : payloads) ASSERT_TRUE(writer->append(++time_, bytes(p)).ok());
    ASSERT_TRUE(writer->flush().ok());
  }
  std::vector<std::string> read(std::uint64_t* torn = nullptr) {
    auto reader = RecordReader::open(path_);
    EXPECT_TRUE(reader.ok()) << reader.status().message();
    std::vector<std::string> out;
    Record r;
    while (reader->next(r)) out.emplace_back(reinterpret_cast<const char*>(r.payload.data()), r.payload.size());
    if (torn != nullptr) *torn = reader->torn_bytes();
    return out;
  }

  test::TempDir folder_;
  const std::string path_ = folder_.path("recording");
  std::int64_t time_ = 0;
};

TEST_F(Recording, RoundTripsRecordsIncludingEmptyOnes) {
  const std::vector<std::string> all = {"one", "", std::string("\0\xFF", 2), std::string(100000, 'x')};
  write(all);
  EXPECT_EQ(read(), all);
}

TEST_F(Recording, TruncatedFileKeepsCompleteRecordsAndCanBeContinued) {
  write({"first", "second", "third"});
  const auto size = std::filesystem::file_size(path_);
  // "third" with its record header has 21 bytes; truncation inside of it loses only this record.
  for (std::uintmax_t cut = 1; cut <= 20; ++cut) {
    std::filesystem::resize_file(path_, size - cut);
    std::uint64_t torn = 0;
    EXPECT_EQ(read(&torn), (std::vector<std::string>{"first", "second"}));
    EXPECT_EQ(torn, 21 - cut);
    write({"third"});
    EXPECT_EQ(read(&torn), (std::vector<std::string>{"first", "second", "third"}));
    EXPECT_EQ(torn, 0U);
    ASSERT_EQ(std::filesystem::file_size(path_), size);
  }
}

TEST_F(Recording, EndsAtADamagedRecord) {
  write({"first", "second", "third"});
  std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(-25, std::ios::end);
  file.put('!');
  file.close();
  std::uint64_t torn = 0;
  EXPECT_EQ(read(&torn), (std::vector<std::string>{"first"}));
  EXPECT_GT(torn, 0U);
}

TEST_F(Recording, DoesNotChangeAFileThatIsNotARecording) {
  std::ofstream(path_) << "my diary";
  const auto writer = RecordWriter::open(path_, {RecordingKind::descriptors, "probe", "1", std::nullopt});
  EXPECT_EQ(writer.status().code(), StatusCode::failed_precondition);
  std::ifstream in(path_);
  std::string text;
  std::getline(in, text);
  EXPECT_EQ(text, "my diary");
}

TEST_F(Recording, DoesNotContinueAnotherKind) {
  write({"a"});
  EXPECT_FALSE(RecordWriter::open(path_, {RecordingKind::frames, "probe", "1", std::nullopt}).ok());
}

/// A recording of descriptors and planes with these messages.
void write_both(const std::string& path, const std::vector<std::pair<RecordedMessage, std::string>>& messages) {
  auto writer = RecordWriter::open(path, {RecordingKind::descriptors_and_planes, "probe", "1", std::nullopt});
  ASSERT_TRUE(writer.ok()) << writer.status().message();
  for (const auto& [message, text] : messages)
    ASSERT_TRUE(writer->append(1, std::as_bytes(std::span(text)), message).ok());
  ASSERT_TRUE(writer->flush().ok());
}

TEST_F(Recording, KeepsWhichMessagesAreOfPlanes) {
  using enum RecordedMessage;
  const std::vector<std::pair<RecordedMessage, std::string>> all = {
      {plane, "p1"}, {descriptor, "d1"}, {plane, ""}, {descriptor, ""}, {plane, std::string(64 * 1024, 'x')}};
  ASSERT_NO_FATAL_FAILURE(write_both(path_, all));
  ASSERT_NO_FATAL_FAILURE(write_both(path_, {{descriptor, "continued"}}));
  auto reader = RecordReader::open(path_);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  EXPECT_EQ(reader->header().kind, RecordingKind::descriptors_and_planes);
  std::vector<std::pair<RecordedMessage, std::string>> got;
  for (Record r; reader->next(r);)
    got.emplace_back(r.message, std::string(reinterpret_cast<const char*>(r.payload.data()), r.payload.size()));
  auto expected = all;
  expected.emplace_back(descriptor, "continued");
  EXPECT_EQ(got, expected);
}

TEST_F(Recording, ARecordThatIsNoKnownMessageIsUnknown) {
  ASSERT_NO_FATAL_FAILURE(write_both(path_, {}));
  // Records that no writer of this version makes: a field of the future, no field, no protobuf message.
  std::ofstream file(path_, std::ios::app | std::ios::binary);
  for (const std::string& payload : {std::string("\x1A\x01x"), std::string(), std::string("\x0A\x05x")}) {
    unsigned char head[16] = {};
    put_le(head, static_cast<std::uint32_t>(payload.size()));
    const std::uint32_t time_crc = crc32c(std::as_bytes(std::span(head).subspan(8)));
    put_le(head + 4, crc32c(std::as_bytes(std::span(payload)), time_crc));
    file.write(reinterpret_cast<const char*>(head), sizeof head);
    file << payload;
  }
  file.close();
  auto reader = RecordReader::open(path_);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  int unknown = 0;
  for (Record r; reader->next(r);) unknown += r.message == RecordedMessage::unknown ? 1 : 0;
  EXPECT_EQ(unknown, 3);
  EXPECT_EQ(reader->torn_bytes(), 0U);
}

TEST_F(Recording, PlanesNeedARecordingOfTheirKind) {
  write({"a"});
  auto writer = RecordWriter::open(path_, {RecordingKind::descriptors, "probe", "1", std::nullopt});
  ASSERT_TRUE(writer.ok());
  EXPECT_EQ(writer->append(1, bytes("p"), RecordedMessage::plane).code(), StatusCode::invalid_argument);
  EXPECT_EQ(
      RecordWriter::open(path_, {RecordingKind::descriptors_and_planes, "probe", "1", std::nullopt}).status().code(),
      StatusCode::failed_precondition);
}

/// Readers that know only container version 1 refuse a recording with planes by the version; all other recordings stay
/// as they were.
TEST_F(Recording, OnlyThoseWithPlanesHaveContainerVersion2) {
  const auto version = [&] {
    std::ifstream file(path_, std::ios::binary);
    file.seekg(5);
    return file.get();
  };
  write({"a"});
  EXPECT_EQ(version(), 1);
  std::filesystem::remove(path_);
  ASSERT_NO_FATAL_FAILURE(write_both(path_, {}));
  EXPECT_EQ(version(), 2);
  for (const int other : {0, 1, 3}) {
    std::fstream(path_, std::ios::in | std::ios::out | std::ios::binary).seekp(5).put(static_cast<char>(other));
    EXPECT_EQ(RecordReader::open(path_).status().code(), StatusCode::data_loss) << other;
  }
  EXPECT_NE(RecordReader::open(path_).status().message().find("version 3 is not known"), std::string::npos);
}

TEST_F(Recording, HeaderKeepsTheCalibration) {
  RigParameters rig;
  rig.nits_per_unit = 3;
  const std::string bytes = encode_calibration(rig);
  ASSERT_TRUE(RecordWriter::open(path_, {RecordingKind::frames, "probe", "1", bytes}).ok());
  const auto reader = RecordReader::open(path_);
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  EXPECT_EQ(reader->header().calibration, bytes);
  EXPECT_EQ(RecordWriter::open(path_, {RecordingKind::frames, "probe", "1", "\xFF"}).status().code(),
            StatusCode::invalid_argument);
}

#ifndef _WIN32  // Windows has no device that is always full.
TEST_F(Recording, ReportsAFullDisk) {
  if (!std::filesystem::exists("/dev/full")) FAIL() << "this machine has no /dev/full";
  std::filesystem::create_symlink("/dev/full", path_);
  auto writer = RecordWriter::open(path_, {RecordingKind::descriptors, "probe", "1", std::nullopt});
  EXPECT_EQ(writer.status().code(), StatusCode::resource_exhausted) << writer.status().message();
}
#endif

TEST(Crc32c, MatchesRfc3720) {
  // RFC 3720, B.4: 32 bytes of zeroes, of ones, and counting up.
  std::vector<std::byte> v(32);
  EXPECT_EQ(crc32c(v), 0x8A9136AAU);
  for (auto& b : v) b = std::byte{0xFF};
  EXPECT_EQ(crc32c(v), 0x62A8AB43U);
  for (std::size_t i = 0; i < 32; ++i) v[i] = static_cast<std::byte>(i);
  EXPECT_EQ(crc32c(v), 0x46DD794EU);
  EXPECT_EQ(crc32c(std::span(v).subspan(16), crc32c(std::span(v).first(16))), 0x46DD794EU);
}

TEST(FrameRecord, RoundTripsMetadataAndPictures) {
  std::vector<std::byte> pixels(3 * 4 * 2);
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<std::byte>(i);
  FrameRecord f;
  f.sequence = 9;
  f.mid_exposure = {123};
  f.exposure_s = 0.01;
  f.gain = 2;
  f.bracket_index = 1;
  f.bracket_size = 3;
  f.views.push_back({1, PixelFormat::rgb8, 4, 2, 12, pixels});
  std::vector<std::byte> payload;
  encode_frame_record(f, payload);
  DecodedFrame back;
  ASSERT_TRUE(back.decode(payload).ok());
  EXPECT_EQ(back.frame.sequence, 9U);
  EXPECT_EQ(back.frame.exposure_s, 0.01);
  EXPECT_EQ(back.frame.bracket_size, 3);
  ASSERT_EQ(back.frame.views.size(), 1U);
  EXPECT_EQ(back.frame.views[0].format, PixelFormat::rgb8);
  EXPECT_TRUE(std::equal(pixels.begin(), pixels.end(), back.frame.views[0].data.begin()));
  for (std::size_t n = 0; n < payload.size(); ++n) (void)back.decode(std::span(payload).first(n));
}

}  // namespace
}  // namespace lightwell
