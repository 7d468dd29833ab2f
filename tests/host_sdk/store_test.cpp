#include "core/store.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace lightwell::core {
namespace {

/// Large enough to detect torn or freed values; counts live instances.
struct Page {
  explicit Page(std::uint64_t n, std::atomic<int>& living) : alive(living) {
    words.fill(n);
    ++alive;
  }
  ~Page() {
    words.fill(~std::uint64_t{0});
    --alive;
  }
  Page(const Page&) = delete;
  Page& operator=(const Page&) = delete;

  std::atomic<int>& alive;
  std::array<std::uint64_t, 64> words{};
};

TEST(LatestStore, IsNullBeforeTheFirstPublish) {
  const LatestStore<int> store;
  EXPECT_EQ(store.read(), nullptr);
}

TEST(LatestStore, ReturnsTheNewest) {
  LatestStore<int> store;
  for (int i = 0; i < 100; ++i) {
    store.publish(std::make_shared<const int>(i));
    ASSERT_NE(store.read(), nullptr);
    EXPECT_EQ(*store.read(), i);
  }
}

TEST(LatestStore, HeldValueStaysValid) {
  LatestStore<int> store;
  store.publish(std::make_shared<const int>(1));
  const std::shared_ptr<const int> held = store.read();
  for (int i = 2; i < 100; ++i) store.publish(std::make_shared<const int>(i));
  EXPECT_EQ(*held, 1);
}

/// Also run under TSan and ASan, which detect races that the assertions do not.
template <std::size_t kSlots>
void stress(std::uint64_t published) {
  constexpr int kReaders = 4;
  std::atomic<int> alive{0};
  {
    LatestStore<Page, kSlots> store;
    std::atomic<bool> done{false};
    std::atomic<int> torn{0}, backwards{0}, ready{0};
    std::atomic<std::uint64_t> seen{0};
    std::vector<std::thread> readers;
    for (int r = 0; r < kReaders; ++r)
      readers.emplace_back([&] {
        std::uint64_t last = 0;
        while (!done.load()) {
          const std::shared_ptr<const Page> page = store.read();
          if (!page) continue;
          if (last == 0) ++ready;
          const std::uint64_t n = page->words.front();
          for (const std::uint64_t word : page->words)
            if (word != n) ++torn;
          if (n < last) ++backwards;
          if (n != last) ++seen;
          last = n;
        }
      });
    store.publish(std::make_shared<const Page>(1, alive));
    while (ready.load() < kReaders) std::this_thread::yield();
    for (std::uint64_t n = 2; n <= published; ++n) {
      store.publish(std::make_shared<const Page>(n, alive));
      // Otherwise, on few cores, the readers might not run meanwhile.
      if (n % 100 == 0) std::this_thread::yield();
    }
    done = true;
    for (std::thread& reader : readers) reader.join();
    EXPECT_EQ(torn.load(), 0);
    EXPECT_EQ(backwards.load(), 0);
    EXPECT_GT(seen.load(), std::uint64_t{kReaders});
    ASSERT_NE(store.read(), nullptr);
    EXPECT_EQ(store.read()->words.front(), published);
  }
  EXPECT_EQ(alive.load(), 0) << "a value was leaked, or freed twice";
}

TEST(LatestStore, ManyReadersSeeWholeValuesInOrder) { stress<8>(6'000); }

/// With two slots, the slot that a reader is about to pin is the next one to be written, which provokes races.
TEST(LatestStore, ManyReadersSeeWholeValuesInTwoSlots) { stress<2>(1'500); }

}  // namespace
}  // namespace lightwell::core
