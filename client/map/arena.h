// Memory for what grows piece by piece and goes at once: pieces are cut from blocks in huge pages,
// which cost a fault for 2 MiB instead of one for each 4 KiB. Faults were a third of a plan's time
// (decision 0611).
#pragma once

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <memory_resource>
#include <vector>

namespace atlas {

// Not for several threads at once.
class Arena : public std::pmr::memory_resource {
 public:
  Arena() = default;
  Arena(const Arena&) = delete;
  Arena& operator=(const Arena&) = delete;
  Arena(Arena&&) = delete;
  Arena& operator=(Arena&&) = delete;
  ~Arena() override = default;

 private:
  struct Free {
    void operator()(void* block) const { std::free(block); }
  };

  // Throws std::bad_alloc.
  void* do_allocate(std::size_t bytes, std::size_t alignment) override;
  void do_deallocate(void* /*piece*/, std::size_t /*bytes*/, std::size_t /*alignment*/) override {}
  bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override {
    return this == &other;
  }
  void AddBlock(std::size_t bytes);

  std::vector<std::unique_ptr<void, Free>> blocks_;
  void* next_ = nullptr;  // in the last block
  std::size_t left_ = 0;
};

}  // namespace atlas
