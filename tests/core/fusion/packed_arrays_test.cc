#include "core/fusion/survey/packed_arrays.h"

#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace atlas {
namespace {

struct Odd {
  std::uint32_t number = 0;
  std::uint8_t letters[5] = {};

  friend bool operator==(const Odd&, const Odd&) = default;
};

TEST(PackedArrays, ComeBackWhateverTheirSize) {
  std::mt19937 random(3);
  for (const std::size_t block : {std::size_t{0}, packed_arrays_internal::kBlockValues<Odd>}) {
    for (const std::size_t size : {block, block + 1, 2 * block + 511, 3 * block + 512}) {
      std::vector<Odd> odd(size);
      for (Odd& value : odd) {
        value.number = static_cast<std::uint32_t>(random() % 1000);
        value.letters[random() % 5] = static_cast<std::uint8_t>(random());
      }
      const std::vector<std::int64_t> others(size / 3, -1);
      const Bytes packed = PackArrays(odd, others);
      EXPECT_EQ(packed.capacity(), packed.size());
      std::vector<Odd> odd_again(7);
      std::vector<std::int64_t> others_again;
      UnpackArrays(packed, odd_again, others_again);
      EXPECT_EQ(odd_again, odd);
      EXPECT_EQ(others_again, others);
    }
  }
}

TEST(PackedArrays, AreSmall) {
  const std::vector<std::uint64_t> rising = [] {
    std::vector<std::uint64_t> values(100'000);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = i;
    return values;
  }();
  EXPECT_LT(PackArrays(rising).size(), rising.size() * sizeof(std::uint64_t) / 20);
}

}  // namespace
}  // namespace atlas
