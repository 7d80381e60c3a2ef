// What the statements of a transaction leave to be written at its end, because it is far less then:
// a row that each of them would change is changed once.
#pragma once

namespace atlas {

class Connection;

class Deferred {
 public:
  Deferred() = default;
  Deferred(const Deferred&) = delete;
  Deferred& operator=(const Deferred&) = delete;
  virtual ~Deferred() = default;

  // What was not written yet. Throws like any statement.
  virtual void Write(Connection& connection) = 0;
  // A savepoint begins; what comes from now on, written or not, never was after Restore().
  virtual void Save() = 0;
  virtual void Restore() = 0;
  // The transaction is over: on disk, or given up.
  virtual void Forget() = 0;
};

}  // namespace atlas
