// Where there is no libFuzzer: every seed, which must be taken; some hundred mutations of each, of
// which some must be taken (else a checksum keeps them all out, and the fuzzer finds nothing);
// every file of the folders, which must not break anything. Usage: fuzz_TARGET MUTATIONS FOLDER...
#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>

#include "tests/fuzz/support/fuzz_target.h"

namespace {

using atlas::Bytes;
using atlas::fuzz::kTarget;

constexpr std::size_t kMaxBytes = 65'536;

atlas::fuzz::Random& Dice() {
  static atlas::fuzz::Random dice(1);
  return dice;
}

std::size_t ReplayFolder(const std::filesystem::path& folder) {
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::ifstream in(entry.path(), std::ios::binary);
    const Bytes input{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    std::fprintf(stderr, "%s\n", entry.path().c_str());  // the last one is what broke it
    kTarget.run(input);
    ++files;
  }
  return files;
}

}  // namespace

extern "C" {

int LLVMFuzzerInitialize(int* argc, char*** argv);

// One byte is changed, added or taken away.
std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size) {
  const std::size_t at = Dice()() % (size + 1);
  const std::size_t rest = size - at;
  if (Dice()() % 4 == 0 && size < max_size) {
    std::memmove(data + at + 1, data + at, rest);
    data[at] = static_cast<std::uint8_t>(Dice()());
    return size + 1;
  }
  if (rest > 1 && Dice()() % 4 == 0) {
    std::memmove(data + at, data + at + 1, rest - 1);
    return size - 1;
  }
  if (rest > 0) {
    data[at] = static_cast<std::uint8_t>(Dice()());
  }
  return size;
}
}

int main(int argc, char** argv) {
  LLVMFuzzerInitialize(&argc, &argv);
  std::size_t mutations = 0;
  if (argc < 2 ||
      std::from_chars(argv[1], argv[1] + std::strlen(argv[1]), mutations).ec != std::errc()) {
    std::fprintf(stderr, "usage: %s MUTATIONS FOLDER... | --write-seeds FOLDER\n", argv[0]);
    return 2;
  }
  std::size_t seeds = 0;
  std::size_t tried = 0;
  std::size_t taken = 0;
  for (const Bytes& seed : kTarget.seeds()) {
    atlas::fuzz::Require(kTarget.run(seed), "every seed is taken");
    ++seeds;
    for (std::size_t i = 0; i < mutations; ++i) {
      const Bytes mutated = kTarget.mutate(seed, kMaxBytes, Dice());
      taken += mutated != seed && kTarget.run(mutated) ? 1U : 0U;
      ++tried;
    }
  }
  std::size_t files = 0;
  for (int i = 2; i < argc; ++i) {
    files += ReplayFolder(argv[i]);
  }
  std::printf("%zu seeds, %zu mutations (%zu taken), %zu files\n", seeds, tried, taken, files);
  atlas::fuzz::Require(mutations == 0 || taken > 0, "some mutations are taken");
  return 0;
}
