#include "tests/fuzz/support/fuzz_target.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>

#include "core/base/str_cat.h"

// libFuzzer's, or replay_main.cc's.
extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace atlas::fuzz {
namespace {

constexpr std::size_t kMostAdded =
    4'096;  // at a time: to make room for more takes longer than the rest

}  // namespace

Bytes Garbled(ByteSpan bytes, std::size_t max_size) {
  const std::size_t size = std::min(bytes.size(), max_size);
  Bytes room(std::max(std::min(max_size, size + kMostAdded), std::size_t{1}));
  std::copy_n(bytes.begin(), size, room.begin());
  room.resize(LLVMFuzzerMutate(room.data(), size, room.size()));
  return room;
}

Bytes MutatePlain(ByteSpan input, std::size_t max_size, Random& /*random*/) {
  return Garbled(input, max_size);
}

void Require(bool holds, const char* promise) {
  if (!holds) {
    std::fprintf(stderr, "broken promise: %s\n", promise);
    std::abort();
  }
}

namespace {

void WriteSeeds(const std::string& folder) {
  std::size_t number = 0;
  for (const Bytes& seed : kTarget.seeds()) {
    std::ofstream out(StrCat(folder, "/seed", number++), std::ios::binary);
    out << TextOf(seed);
    Require(out.good(), "seeds are written");
  }
}

}  // namespace
}  // namespace atlas::fuzz

extern "C" {

// With --write-seeds FOLDER it does that and ends.
int LLVMFuzzerInitialize(int* argc, char*** argv) {
  if (*argc == 3 && std::strcmp((*argv)[1], "--write-seeds") == 0) {
    atlas::fuzz::WriteSeeds((*argv)[2]);
    std::exit(0);
  }
  return 0;
}

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  atlas::fuzz::kTarget.run({data, size});
  return 0;
}

std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data,
                                    std::size_t size,
                                    std::size_t max_size,
                                    unsigned seed) {
  atlas::fuzz::Random random(seed);
  const atlas::Bytes mutated = atlas::fuzz::kTarget.mutate({data, size}, max_size, random);
  if (mutated.empty() || mutated.size() > max_size) {
    return size;  // as it was
  }
  std::copy(mutated.begin(), mutated.end(), data);
  return mutated.size();
}
}
