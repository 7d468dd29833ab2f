// Clients that are killed, stopped, slow or numerous do not affect other clients.
#include <atomic>
#include <csignal>
#include <mutex>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <lightwell/codec.hpp>
#include <lightwell/recording.hpp>

#include "e2e/daemon.hpp"
#include "support/panorama_file.hpp"

namespace lightwell::test {
namespace {

class ClientsTest : public ::testing::Test {
 protected:
  ClientsTest() { write_exr(folder_.path("room.exr"), room_with_lamp_at_plus_x()); }
  [[nodiscard]] DaemonOptions at(double frame_rate) const {
    return {.camera = "sim:" + folder_.path("room.exr"), .frame_rate = frame_rate};
  }
  [[nodiscard]] static ::testing::AssertionResult clients_become(const Observer& observer, std::uint32_t count) {
    return becomes_true("the probe counts " + std::to_string(count) + " clients",
                        [&] { return observer.counters().clients == count; });
  }
  /// Descriptors that one of two good clients missed and the other received: lost by the link. Those that neither
  /// received were lost before, on a busy machine.
  static std::vector<std::uint64_t> missing_in_one(const Observer& one, const Observer& other) {
    std::vector<std::uint64_t> out;
    const auto others = other.bytes();
    for (const std::uint64_t s : one.missing())
      if (others.contains(s)) out.push_back(s);
    return out;
  }

  /// Sequence numbers in the complete records of a recording that may still be written.
  static std::vector<std::uint64_t> recorded_sequences(const std::string& file) {
    std::vector<std::uint64_t> out;
    Result<RecordReader> reader = RecordReader::open(file);
    Record record;
    while (reader.ok() && reader->next(record))
      if (const Result<Descriptor> d = decode_descriptor(record.payload); d.ok()) out.push_back(d->sequence);
    return out;
  }

  TempDir folder_;
};

TEST_F(ClientsTest, AKilledClientIsRemovedAndOthersHaveNoGap) {
  Daemon daemon(at(10));
  const Observer one(daemon.uri()), other(daemon.uri());
  ASSERT_TRUE(clients_become(one, 2));
  for (int i = 0; i < 3; ++i) {
    Child victim(tool_command({"watch", daemon.uri()}));
    ASSERT_TRUE(clients_become(one, 3));
    victim.signal(SIGKILL);
    EXPECT_EQ(victim.wait().signal, SIGKILL);
    ASSERT_TRUE(one.gets(5));
    ASSERT_TRUE(clients_become(one, 2));
  }
  // On a busy machine one of them may be delayed by a frame.
  EXPECT_LE(missing_in_one(one, other).size() + missing_in_one(other, one).size(), one.count() / 10);
  EXPECT_EQ(one.probe().stats().reconnects, 0U);
}

TEST_F(ClientsTest, ForAStoppedClientDescriptorsAreCoalescedAndOthersHaveNoGap) {
  Daemon daemon(at(20));
  const Observer one(daemon.uri()), other(daemon.uri());
  const std::string file = folder_.path("sleeper.lwr");
  Child sleeper(tool_command({"record", daemon.uri(), file}));
  // A gap is counted between two descriptors, so one must come before the stop.
  ASSERT_TRUE(becomes_true("the client records descriptors", [&] { return !recorded_sequences(file).empty(); }));
  sleeper.signal(SIGSTOP);
  const std::uint64_t before = one.counters().descriptors_coalesced;
  ASSERT_TRUE(becomes_true("the descriptors that the stopped client misses are counted",
                           [&] { return one.counters().descriptors_coalesced > before + 10; }));
  ASSERT_TRUE(one.gets(30));
  const auto lost = missing_in_one(one, other).size() + missing_in_one(other, one).size();
  // On a busy machine one of them may be delayed by a frame; a blocking link would lose all.
  EXPECT_LE(lost, one.count() / 10) << "a stopped client must not delay others";
  sleeper.signal(SIGCONT);
  // The descriptors that the operating system had buffered for the client come before the gap.
  ASSERT_TRUE(becomes_true("the client records the newest descriptors", [&] {
    const std::vector<std::uint64_t> all = recorded_sequences(file);
    return all.back() - all.front() >= all.size();
  }));
  sleeper.signal(SIGTERM);
  EXPECT_EQ(sleeper.wait(), (ExitStatus{0, 0})) << sleeper.err();
  EXPECT_THAT(sleeper.out(), ::testing::Not(::testing::HasSubstr(" 0 gaps")))
      << "the stopped client must count its gap";
}

TEST_F(ClientsTest, ASlowApplicationGetsTheNewestDescriptor) {
  Daemon daemon(at(50));
  const Observer quick(daemon.uri());
  std::mutex gate;
  std::atomic<std::uint64_t> newest{0};
  std::atomic<int> came{0};
  ProbeOptions options;
  options.on_descriptor = [&](const Arrival& arrival) {
    const std::lock_guard lock(gate);
    newest = arrival.descriptor.sequence;
    ++came;
  };
  Result<Probe> slow = Probe::connect(daemon.uri(), options);
  ASSERT_TRUE(slow.ok()) << slow.status().message();
  ASSERT_TRUE(becomes_true("the slow client gets its first descriptor", [&] { return came > 0; }));
  std::unique_lock closed(gate);
  const std::uint64_t before = quick.counters().descriptors_coalesced;
  ASSERT_TRUE(becomes_true("the probe coalesces descriptors",
                           [&] { return quick.counters().descriptors_coalesced > before + 50; }));
  const std::uint64_t now = quick.descriptors().back().sequence;
  const int had = came;
  closed.unlock();
  ASSERT_TRUE(becomes_true("it is up to date again", [&] { return newest >= now; }));
  EXPECT_LT(came - had, 60) << "outdated descriptors must not be delivered";
}

TEST_F(ClientsTest, TheNumberOfThreadsDoesNotDependOnTheNumberOfClients) {
  Daemon daemon(at(30));
  const Observer first(daemon.uri());
  const auto threads_with = [&](std::size_t count) {
    std::vector<std::unique_ptr<Observer>> crowd;
    while (crowd.size() + 1 < count) crowd.push_back(std::make_unique<Observer>(daemon.uri()));
    EXPECT_TRUE(clients_become(first, static_cast<std::uint32_t>(count)));
    for (const auto& o : crowd) EXPECT_TRUE(o->gets(10));
    EXPECT_TRUE(first.gets(10));
    return daemon.process().status_number("Threads");
  };
  // gRPC's thread pools grow with the load, up to two threads per core, so they are filled first.
  threads_with(32);
  const long with_one = threads_with(1), with_many = threads_with(32);
  EXPECT_GT(with_one, 0);
  EXPECT_LT(with_many - with_one, 4) << "one thread per client would be 31 more";
}

TEST_F(ClientsTest, EveryClientGetsTheSameBytes) {
  Daemon daemon(at(30));
  const Observer one(daemon.uri()), other(daemon.uri());
  ASSERT_TRUE(one.gets(20));
  const auto a = one.bytes(), b = other.bytes();
  std::size_t both = 0;
  for (const auto& [sequence, bytes] : a) {
    if (!b.contains(sequence)) continue;
    ++both;
    EXPECT_EQ(bytes, b.at(sequence)) << sequence;
  }
  EXPECT_GE(both, 10U);
}

}  // namespace
}  // namespace lightwell::test
