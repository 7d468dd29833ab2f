#include <algorithm>
#include <map>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include <lightwell/bytes.hpp>
#include <lightwell/framing.hpp>

namespace lightwell {
namespace {

using Bytes = std::vector<std::byte>;

Bytes bytes_of(const std::string& text) {
  const auto b = std::as_bytes(std::span(text));
  return {b.begin(), b.end()};
}

Bytes frame_of(FrameWriter& writer, const Bytes& payload, FrameKind kind = FrameKind::descriptor) {
  Bytes out;
  const Status written = writer.write(kind, payload, out);
  EXPECT_TRUE(written.ok()) << written.message();
  return out;
}

struct Received {
  FrameKind kind;
  std::uint32_t session;
  std::uint64_t sequence;
  Bytes payload;
};

/// A reader and all frames that it delivered.
struct Listener {
  FrameReader reader;
  std::vector<Received> all;
  FrameReader::FrameCallback take = [this](const LinkFrame& f) {
    all.push_back({f.kind, f.session, f.sequence, {f.payload.begin(), f.payload.end()}});
  };
  void push(std::span<const std::byte> bytes) { reader.push(bytes, take); }
  [[nodiscard]] std::vector<std::uint64_t> numbers() const {
    std::vector<std::uint64_t> out;
    for (const Received& r : all) out.push_back(r.sequence);
    return out;
  }
};

/// Rewrites the checksum of a header that a test has changed.
void seal(Bytes& frame) {
  const std::uint32_t crc = crc32c(std::span(frame).first(28));
  for (std::size_t i = 0; i < 4; ++i) frame[28 + i] = static_cast<std::byte>(crc >> (8 * i));
}

Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST(Framing, MessagesOfEverySizeAreReceivedInPiecesOfAnySize) {
  std::mt19937 random(1);
  for (const std::size_t piece : {std::size_t{1}, std::size_t{7}, std::size_t{512}, std::size_t{1} << 20}) {
    FrameWriter writer(5);
    Listener listener;
    Bytes stream;
    std::vector<Bytes> sent;
    for (std::size_t size = 0; size < 200; ++size) {
      Bytes payload(size);
      for (std::byte& b : payload) b = static_cast<std::byte>(random());
      sent.push_back(payload);
      stream = stream + frame_of(writer, payload);
    }
    for (std::size_t at = 0; at < stream.size(); at += piece)
      listener.push(std::span(stream).subspan(at, std::min(piece, stream.size() - at)));
    ASSERT_EQ(listener.all.size(), sent.size()) << "in pieces of " << piece;
    for (std::size_t i = 0; i < sent.size(); ++i) {
      EXPECT_EQ(listener.all[i].payload, sent[i]);
      EXPECT_EQ(listener.all[i].sequence, i + 1);
      EXPECT_EQ(listener.all[i].session, 5U);
    }
    EXPECT_EQ(listener.reader.counters().skipped_bytes, 0U) << "padding between frames does not count as damage";
    EXPECT_EQ(listener.reader.counters().refused(), 0U);
  }
}

TEST(Framing, ATransferOfOneFrameAlwaysEndsWithAShortPacket) {
  FrameWriter writer(1);
  for (std::size_t size = 0; size < 1100; ++size) EXPECT_NE(frame_of(writer, Bytes(size)).size() % kFrameGranule, 0U);
  EXPECT_LE(frame_of(writer, Bytes(kMaxDescriptorBytes)).size(), kMaxFrameBytes);
}

TEST(Framing, OversizedMessagesAreRefusedWithoutUsingASequenceNumber) {
  FrameWriter writer(1);
  Bytes out;
  EXPECT_EQ(writer.write(FrameKind::descriptor, Bytes(kMaxDescriptorBytes + 1), out).code(),
            StatusCode::invalid_argument);
  EXPECT_EQ(writer.write(FrameKind::plane, Bytes(kMaxPlaneMessageBytes + 1), out).code(), StatusCode::invalid_argument);
  EXPECT_EQ(writer.write(FrameKind::request, Bytes(kMaxLinkMessageBytes + 1), out).code(),
            StatusCode::invalid_argument);
  EXPECT_EQ(writer.sequence(), 0U);
  Listener listener;
  listener.push(frame_of(writer, Bytes(kMaxDescriptorBytes)));
  listener.push(frame_of(writer, Bytes(kMaxLinkMessageBytes), FrameKind::request));
  listener.push(frame_of(writer, Bytes(kMaxPlaneMessageBytes), FrameKind::plane));
  EXPECT_EQ(listener.numbers(), (std::vector<std::uint64_t>{1, 2, 3}));
}

TEST(Framing, AFlippedBitLosesOnlyItsFrame) {
  FrameWriter writer(9);
  const Bytes first = frame_of(writer, bytes_of("first")), second = frame_of(writer, bytes_of("second")),
              third = frame_of(writer, bytes_of("third"));
  for (std::size_t bit = 0; bit < 8 * second.size(); ++bit) {
    Bytes damaged = second;
    damaged[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
    Listener listener;
    // With an increased length the reader waits for more bytes, until the end of the transfer.
    listener.push(first + damaged + third);
    listener.reader.end_transfer(listener.take);
    // The two reserved bytes of a header are covered by its checksum, too.
    ASSERT_EQ(listener.numbers(), (std::vector<std::uint64_t>{1, 3})) << "bit " << bit;
    EXPECT_EQ(listener.all[1].payload, bytes_of("third"));
    EXPECT_EQ(listener.reader.counters().lost, 1U);
    EXPECT_EQ(listener.reader.counters().skipped_bytes, second.size());
  }
}

TEST(Framing, LostBytesLoseOnlyTheirFrames) {
  FrameWriter writer(9);
  const Bytes first = frame_of(writer, bytes_of("first")), second = frame_of(writer, bytes_of("second one")),
              third = frame_of(writer, bytes_of("third")), fourth = frame_of(writer, Bytes(100, std::byte{7}));
  const Bytes whole = first + second + third;
  for (std::size_t from = first.size(); from < first.size() + second.size(); ++from)
    for (std::size_t length = 1; length <= first.size() + second.size() - from; ++length) {
      Bytes cut = whole;
      cut.erase(cut.begin() + static_cast<std::ptrdiff_t>(from),
                cut.begin() + static_cast<std::ptrdiff_t>(from + length));
      Listener listener;
      listener.push(cut + fourth);
      listener.reader.end_transfer(listener.take);
      ASSERT_EQ(listener.numbers(), (std::vector<std::uint64_t>{1, 3, 4})) << from << " " << length;
    }
}

TEST(Framing, EndOfTransferDeliversFramesAfterLostBytesAtOnce) {
  FrameWriter writer(9);
  const Bytes large = frame_of(writer, Bytes(60'000, std::byte{1})), next = frame_of(writer, bytes_of("next"));
  Listener listener;
  listener.push(std::span(large).first(1000));
  listener.reader.end_transfer(listener.take);
  listener.push(next);
  EXPECT_EQ(listener.numbers(), std::vector<std::uint64_t>{2}) << "59,000 bytes are not waited for";
  EXPECT_EQ(listener.reader.counters().cut_off, 1U);

  Listener later;
  later.push(std::span(large).first(1000));
  later.reader.begin_stream();
  later.push(next);
  EXPECT_EQ(later.numbers(), std::vector<std::uint64_t>{2});
  EXPECT_EQ(later.reader.counters().cut_off, 1U);
  EXPECT_EQ(later.reader.counters().skipped_bytes, 1000U);
}

TEST(Framing, AFrameInsideAPayloadIsPayload) {
  FrameWriter inner(3), outer(4);
  const Bytes hidden = frame_of(inner, bytes_of("hidden"));
  const Bytes carrier = frame_of(outer, bytes_of("before ") + hidden + bytes_of("LWF\xA7 after"));
  Listener listener;
  for (const std::byte& b : carrier) listener.push({&b, 1});
  ASSERT_EQ(listener.all.size(), 1U);
  EXPECT_EQ(listener.all[0].session, 4U);
}

TEST(Framing, NoFrameIsFoundInNoise) {
  std::mt19937 random(2);
  Listener listener;
  Bytes noise(1 << 20);
  for (std::byte& b : noise) b = static_cast<std::byte>(random() | 1U);  // Contains no padding byte.
  listener.push(noise);
  listener.reader.end_transfer(listener.take);
  EXPECT_TRUE(listener.all.empty());
  EXPECT_EQ(listener.reader.counters().skipped_bytes, noise.size());
  FrameWriter writer(1);
  listener.push(frame_of(writer, bytes_of("still here")));
  EXPECT_EQ(listener.all.size(), 1U);
}

TEST(Framing, OversizedUnknownAndReplayedFramesAreCountedSeparately) {
  FrameWriter writer(1), next_life(2);
  const Bytes first = frame_of(writer, bytes_of("1"));
  Bytes oversized = frame_of(writer, bytes_of("2"));
  oversized[13] = oversized[14] = std::byte{0xFF};
  seal(oversized);
  Bytes oversized_request = frame_of(writer, bytes_of("3"), FrameKind::request);
  oversized_request[13] = std::byte{0x21};  // 8 KiB and 257 bytes
  seal(oversized_request);
  Bytes version = frame_of(writer, bytes_of("4"));
  version[4] = std::byte{2};
  seal(version);
  Bytes kind = frame_of(writer, bytes_of("5"));
  kind[5] = std::byte{77};
  seal(kind);
  Bytes number_zero = frame_of(writer, bytes_of("6"));
  number_zero[16] = std::byte{0};
  seal(number_zero);
  const Bytes last = frame_of(writer, bytes_of("7"));

  Listener listener;
  listener.push(first + oversized + oversized_request + version + kind + number_zero + first + last);
  EXPECT_EQ(listener.numbers(), (std::vector<std::uint64_t>{1, 7}));
  const FrameCounters& c = listener.reader.counters();
  EXPECT_EQ(c.oversized, 2U);
  EXPECT_EQ(c.unknown, 2U);
  EXPECT_EQ(c.replayed, 2U);
  EXPECT_EQ(c.refused(), 6U);
  EXPECT_EQ(c.lost, 3U) << "the two that were too large, and number 6, which called itself 0";

  // A restarted probe starts a new session; frames of the old session are then rejected as replays.
  const Bytes anew = frame_of(next_life, bytes_of("new")), old = frame_of(writer, bytes_of("8"));
  listener.push(anew + first + old);
  EXPECT_EQ(listener.all.back().payload, bytes_of("new"));
  EXPECT_EQ(c.replayed, 4U);
  EXPECT_EQ(c.lost, 3U) << "a new session does not count as loss";
}

/// One random mistake in a stream of frames: which of its bytes are not what was sent, or where something was put
/// between.
class Damage {
 public:
  explicit Damage(std::uint32_t seed) : random_(seed) {}

  /// `intact[i]`: frame i is still there, byte for byte, in one piece.
  void harm(std::vector<Bytes>& frames, std::vector<bool>& intact) {
    const std::size_t i = below(frames.size());
    Bytes& f = frames[i];
    if (f.empty()) return;
    const std::size_t at = below(f.size());
    const auto here = f.begin() + static_cast<std::ptrdiff_t>(at);
    switch (below(6)) {
      case 0:
        f[at] ^= static_cast<std::byte>(1U << below(8));
        break;
      case 1:
        f.erase(here, here + static_cast<std::ptrdiff_t>(1 + below(f.size() - at)));
        break;
      case 2: {
        Bytes noise(1 + below(100));
        for (std::byte& b : noise) b = static_cast<std::byte>(random_());
        f.insert(here, noise.begin(), noise.end());
        // Inserted before a frame, it does not damage the frame.
        if (at == 0) return;
        break;
      }
      case 3:
        std::fill(here, f.end(), std::byte{0});
        break;
      case 4: {
        const Bytes magic = bytes_of("LWF\xA7");
        f.insert(here, magic.begin(), magic.end());
        if (at == 0) return;
        break;
      }
      case 5:  // An intact header with an incomplete payload.
        f.resize(std::min<std::size_t>(f.size() - 1, kFrameHeaderBytes + below(8)));
        break;
    }
    intact[i] = false;
  }

  std::size_t below(std::size_t n) { return random_() % n; }

 private:
  std::mt19937 random_;
};

TEST(Framing, WithRandomDamageExactlyTheIntactFramesAreReceived) {
  std::uint64_t frames_sent = 0, frames_got = 0;
  for (std::uint32_t seed = 0; seed < 3000; ++seed) {
    Damage damage(seed);
    FrameWriter writer(seed);
    std::vector<Bytes> frames;
    std::map<std::uint64_t, Bytes> payloads;
    for (std::size_t i = 0; i < 20; ++i) {
      Bytes payload(damage.below(seed % 3 == 0 ? 2000 : 150));
      for (std::byte& b : payload) b = static_cast<std::byte>(damage.below(5) == 0 ? 'L' : damage.below(256));
      // After truncation, an 'L' at its end could be completed by the next frame's first byte: same bytes, other
      // frames.
      if (!payload.empty()) payload.back() = std::byte{'x'};
      payloads[i + 1] = payload;
      frames.push_back(frame_of(writer, payload));
    }
    std::vector<bool> intact(frames.size(), true);
    for (std::size_t k = damage.below(8); k > 0; --k) {
      // A second fault may affect a frame that is damaged already; it stays damaged.
      damage.harm(frames, intact);
    }
    Bytes stream;
    for (const Bytes& f : frames) stream = stream + f;
    Listener listener;
    for (std::size_t at = 0; at < stream.size();) {
      const std::size_t piece = std::min(stream.size() - at, 1 + damage.below(700));
      listener.push(std::span(stream).subspan(at, piece));
      at += piece;
    }
    listener.reader.end_transfer(listener.take);

    std::vector<std::uint64_t> expected;
    for (std::size_t i = 0; i < frames.size(); ++i)
      if (intact[i]) expected.push_back(i + 1);
    // A damaged padding byte leaves its frame intact.
    std::vector<std::uint64_t> got = listener.numbers();
    std::size_t whole_bytes = 0;
    for (const Received& r : listener.all) {
      ASSERT_EQ(r.payload, payloads[r.sequence]) << "seed " << seed;
      whole_bytes += kFrameHeaderBytes + r.payload.size();
    }
    ASSERT_TRUE(std::is_sorted(got.begin(), got.end())) << "seed " << seed;
    ASSERT_TRUE(std::includes(got.begin(), got.end(), expected.begin(), expected.end()))
        << "seed " << seed << ": " << testing::PrintToString(got) << " without some of "
        << testing::PrintToString(expected);
    const FrameCounters& c = listener.reader.counters();
    ASSERT_EQ(c.frames, got.size());
    if (!got.empty()) {
      ASSERT_EQ(c.lost, got.back() - got.front() + 1 - got.size()) << "seed " << seed;
    }
    ASSERT_LE(whole_bytes + c.skipped_bytes, stream.size()) << "seed " << seed;
    frames_sent += expected.size();
    frames_got += got.size();
  }
  // Padding bytes (one frame in 64 has one) and their damage.
  EXPECT_LE(frames_got - frames_sent, frames_sent / 500);
  EXPECT_GT(frames_sent, 40'000U);
}

}  // namespace
}  // namespace lightwell
