#include "core/base/lru_list.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace atlas {
namespace {

struct Value {
  std::uint64_t key = 0;
  int rank = 0;
  std::size_t bytes = 0;
};

// What an LruList is, in a vector: the newest first.
class PlainList {
 public:
  void Insert(const Value& value, int rank) {
    Take(value.key);
    const auto place = std::find_if(values_.begin(), values_.end(),
                                    [&](const Value& other) { return other.rank <= rank; });
    values_.insert(place, value);
  }
  bool Use(std::uint64_t key) {
    const auto value = Take(key);
    if (value) {
      values_.insert(values_.begin(), *value);
    }
    return value.has_value();
  }
  std::optional<Value> Take(std::uint64_t key) {
    return TakeAt(std::find_if(values_.begin(), values_.end(),
                               [&](const Value& value) { return value.key == key; }));
  }
  std::optional<Value> TakeOldest(int remainder) {
    const auto found = std::find_if(values_.rbegin(), values_.rend(), [&](const Value& value) {
      return value.rank % 3 == remainder;
    });
    return found == values_.rend() ? std::nullopt : TakeAt(std::prev(found.base()));
  }
  std::optional<Value> TakeOldestAbove(std::size_t limit) {
    return bytes() > limit ? TakeAt(std::prev(values_.end())) : std::nullopt;
  }
  std::size_t bytes() const {
    std::size_t bytes = 0;
    for (const Value& value : values_) bytes += value.bytes;
    return bytes;
  }

 private:
  std::optional<Value> TakeAt(std::vector<Value>::iterator place) {
    if (place == values_.end()) {
      return std::nullopt;
    }
    const Value value = *place;
    values_.erase(place);
    return value;
  }

  std::vector<Value> values_;
};

std::uint64_t KeyOf(const std::optional<Value>& value) {
  return value ? value->key : 999;
}

TEST(LruList, DoesWhatAPlainListDoes) {
  std::mt19937 random(7);
  LruList<Value> list;
  PlainList plain;
  std::size_t taken = 0;
  for (int step = 0; step < 20'000; ++step) {
    const std::uint64_t key = random() % 20;
    const Value value{key, static_cast<int>(random() % 5), random() % 100};
    std::optional<Value> a;
    std::optional<Value> b;
    switch (random() % 6) {
      case 0:
        list.Insert(key, value, value.bytes);
        plain.Insert(value, 5);
        break;
      case 1:
        list.Insert(key, value, value.bytes,
                    [&](const Value& other) { return other.rank > value.rank; });
        plain.Insert(value, value.rank);
        break;
      case 2:
        EXPECT_EQ(list.Use(key) != nullptr, plain.Use(key));
        break;
      case 3:
        a = list.Take(key);
        b = plain.Take(key);
        break;
      case 4:
        a = list.TakeOldestAbove(300);
        b = plain.TakeOldestAbove(300);
        break;
      default:
        a = list.TakeOldest([&](const Value& other) { return other.rank % 3 == 1; });
        b = plain.TakeOldest(1);
    }
    ASSERT_EQ(KeyOf(a), KeyOf(b)) << "step " << step;
    ASSERT_EQ(list.bytes(), plain.bytes()) << "step " << step;
    taken += a ? 1u : 0u;
  }
  EXPECT_GT(taken, 1'000u);
}

}  // namespace
}  // namespace atlas
