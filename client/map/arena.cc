#include "client/map/arena.h"

#include <algorithm>
#include <new>
#include <utility>

#include <sys/mman.h>

namespace atlas {
namespace {

constexpr std::size_t kHugePage = std::size_t{2} << 20;
constexpr std::size_t kBlock = 4 * kHugePage;

}  // namespace

void* Arena::do_allocate(std::size_t bytes, std::size_t alignment) {
  if (std::align(alignment, bytes, next_, left_) == nullptr) {
    AddBlock(bytes + alignment);
    std::align(alignment, bytes, next_, left_);
  }
  left_ -= bytes;
  return std::exchange(next_, static_cast<std::byte*>(next_) + bytes);
}

void Arena::AddBlock(std::size_t bytes) {
  const std::size_t whole = (std::max(bytes, kBlock) + kHugePage - 1) / kHugePage * kHugePage;
  std::unique_ptr<void, Free> block(std::aligned_alloc(kHugePage, whole));
  if (block == nullptr) throw std::bad_alloc();
  madvise(block.get(), whole, MADV_HUGEPAGE);  // where there are none, small ones do as well
  next_ = block.get();
  left_ = whole;
  blocks_.push_back(std::move(block));
}

}  // namespace atlas
