// A store that lives a life on a disk that fails at any one of its calls, once or from then on, is
// full, or loses its power: what its life left is judged after the next opening.
#pragma once

#include <string>

#include "tests/core/support/test_scale.h"
#include "tests/server/store/faulty_vfs.h"
#include "tests/server/store/store_fixture.h"

namespace atlas {

class IoFaultFixture : public StoreTest {
 protected:
  using Calls = FaultyVfs::Calls;
  using Until = FaultyVfs::Until;
  using Loss = VolatileFiles::Loss;

  explicit IoFaultFixture(std::uint32_t stride = testing::Stride()) : stride_(stride) {}
  ~IoFaultFixture() override { store_.reset(); }  // before the layer that it was opened with goes

  // What is there before each life: an empty folder, and a test that knows of no life yet.
  virtual void Prepare() = 0;
  // Goes as far as the disk lets it.
  virtual void Live() = 0;
  // Afterwards, on a disk that works.
  virtual void ExpectAllThere() = 0;

  // False: it cannot be opened.
  bool TryOpen() {
    store_.reset();
    auto store = OpenSqliteStore(options_);
    if (!store) {
      EXPECT_FALSE(store.error().message().empty());
      return false;
    }
    store_ = std::move(*store);
    return true;
  }
  // Of several pages.
  static NewKeyframe Large(std::uint32_t sequence, std::vector<TileId> footprint) {
    NewKeyframe keyframe = MakeKeyframe(sequence, std::move(footprint));
    keyframe.blob.resize(30'000, static_cast<std::uint8_t>(sequence));
    return keyframe;
  }

  // As if the process was killed: what the system has stays.
  void Kill() {
    vfs_.FailAt(1, Calls::kAll, Until::kHealed);
    store_.reset();
    vfs_.Heal();
  }
  void CutPower() {
    Kill();
    vfs_.LosePower(Loss::kAll, 0);
  }
  void FailSyncs(std::uint64_t number) { vfs_.FailAt(number, Calls::kSync, Until::kOnce); }

  // Each call in its turn, or one in `stride_`, until none is left to fail. How many there were.
  std::uint64_t FailEach(Calls calls, Until until, bool is_full = false) {
    return FailEach(calls, until, is_full, [](std::uint64_t) {});
  }
  // From each call on nothing reaches the disk, and of what did not have to be there some is not.
  // How many calls there were.
  std::uint64_t CutPowerAtEach(Loss loss) {
    std::uint64_t calls = 0;
    for (std::uint32_t round = 0; round < testing::Scaled(1) && !HasFailure(); ++round) {
      SCOPED_TRACE("round " + std::to_string(round));
      calls += FailEach(Calls::kAll, Until::kHealed, false, [&](std::uint64_t number) {
        vfs_.LosePower(loss, 1'000 * round + static_cast<std::uint32_t>(number));
      });
    }
    RecordProperty("calls", static_cast<int>(calls));
    return calls;
  }

 private:
  // `then` whatever becomes of the disk.
  template <typename Then>
  std::uint64_t FailEach(Calls calls, Until until, bool is_full, const Then& then) {
    for (std::uint64_t number = 1;; number += stride_) {
      store_.reset();
      std::filesystem::remove_all(options_.directory);
      Prepare();
      vfs_.BeginAnew();
      vfs_.FailAt(number, calls, until, is_full);
      Live();
      store_.reset();
      const bool has_failed = vfs_.Heal();
      then(number);
      SCOPED_TRACE("call " + std::to_string(number) + ", " + vfs_.first());
      ExpectAllThere();
      if (!has_failed || HasFailure()) {
        return number - 1;
      }
    }
  }

  const std::uint32_t stride_;
  FaultyVfs vfs_;
};

}  // namespace atlas
