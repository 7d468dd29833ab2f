// Makes frames, recordings and folders of pictures for tests.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <lightwell/frame_record.hpp>
#include <lightwell/recording.hpp>

#include "imaging/frame.hpp"
#include "imaging/image_file.hpp"
#include "support/temp_dir.hpp"

namespace lightwell {

struct MadeFrames {
  int count = 64;
  int width = 32, height = 24;
  int lenses = 2;
  std::vector<double> exposure_s{0.001};
  double rate = 100;
};

/// A picture whose bytes differ between frames and between lenses.
inline std::vector<std::byte> made_picture(const MadeFrames& made, std::uint64_t sequence, int lens) {
  std::vector<std::byte> data(
      picture_bytes(PixelFormat::rgb8, packed_stride(PixelFormat::rgb8, made.width), made.height));
  for (std::size_t i = 0; i < data.size(); ++i)
    data[i] = static_cast<std::byte>(i * 7 + sequence * 31 + static_cast<unsigned>(lens) * 101);
  return data;
}

/// `change` may alter a record before it is written; if it returns false, the record is omitted.
inline std::string write_recording(
    const std::string& path, const MadeFrames& made,
    const std::function<bool(FrameRecord&)>& change = [](FrameRecord&) { return true; }) {
  RecordingHeader header;
  header.kind = RecordingKind::frames;
  Result<RecordWriter> writer = RecordWriter::open(path, header);
  if (!writer) {
    ADD_FAILURE() << writer.status().message();
    return path;
  }
  std::vector<std::byte> bytes;
  for (int i = 0; i < made.count; ++i) {
    FrameRecord frame;
    frame.sequence = static_cast<std::uint64_t>(i);
    frame.mid_exposure = {static_cast<std::int64_t>(5e9 + 1e9 * i / made.rate)};
    frame.bracket_size = static_cast<int>(made.exposure_s.size());
    frame.bracket_index = i % frame.bracket_size;
    frame.exposure_s = made.exposure_s[static_cast<std::size_t>(frame.bracket_index)];
    std::vector<std::vector<std::byte>> pictures;
    for (int lens = 0; lens < made.lenses; ++lens) pictures.push_back(made_picture(made, frame.sequence, lens));
    for (int lens = 0; lens < made.lenses; ++lens)
      frame.views.push_back({lens, PixelFormat::rgb8, made.width, made.height,
                             packed_stride(PixelFormat::rgb8, made.width), pictures[static_cast<std::size_t>(lens)]});
    if (!change(frame)) continue;
    encode_frame_record(frame, bytes);
    EXPECT_TRUE(writer->append(frame.mid_exposure.ns, bytes).ok());
  }
  EXPECT_TRUE(writer->flush().ok());
  return path;
}

/// Writes a folder with frames.csv and PNG files.
inline std::string write_folder(const std::string& path, const MadeFrames& made) {
  std::filesystem::create_directories(path);
  std::ofstream list(path + "/frames.csv");
  list << "file,lens,exposure_s,time_s,bracket_index,bracket_size\n";
  for (int i = 0; i < made.count; ++i)
    for (int lens = 0; lens < made.lenses; ++lens) {
      const std::string name = std::to_string(i) + "_" + std::to_string(lens) + ".png";
      const Image image{made.width, made.height, PixelFormat::rgb8,
                        made_picture(made, static_cast<std::uint64_t>(i), lens)};
      EXPECT_TRUE(write_png(path + "/" + name, image).ok());
      const std::size_t index = static_cast<std::size_t>(i) % made.exposure_s.size();
      list << name << ',' << lens << ',' << made.exposure_s[index] << ',' << i / made.rate << ',' << index << ','
           << made.exposure_s.size() << '\n';
    }
  return path;
}

}  // namespace lightwell
