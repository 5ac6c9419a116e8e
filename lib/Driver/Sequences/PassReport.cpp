// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Piko/Driver/PassReport.h"

#include "mlir/IR/OperationSupport.h"
#include "mlir/Pass/Pass.h"
#include "mlir/Pass/PassInstrumentation.h"
#include "mlir/Pass/PassManager.h"
#include "llvm/ADT/DenseMap.h"
#include "llvm/ADT/STLExtras.h"
#include "llvm/Support/JSON.h"

using namespace mlir;
using namespace piko;

using Count = std::pair<std::string, int64_t>;

/// Calls of this come one at a time, though passes may run side by side.
struct PassReport::Instrumentation : PassInstrumentation {
  explicit Instrumentation(PassReport &report) : report(report) {}

  void runBeforePass(Pass *pass, Operation *op) override {
    if (pass->getArgument().empty()) // it hands others' operations on
      return;
    (void)report.entries[pass->getArgument().str()];
    before.try_emplace(pass, op, count(op));
  }
  void runAfterPass(Pass *pass, Operation *op) override {
    auto found = before.find(pass);
    if (found == before.end())
      return;
    auto &[print, operations] = found->second;
    Entry &entry = report.entries[pass->getArgument().str()];
    ++entry.runs;
    if (print != OperationFingerPrint(op)) {
      ++entry.changes;
      for (auto [name, number] : count(op))
        entry.operations[name.getStringRef().str()] += number;
      for (auto [name, number] : operations)
        entry.operations[name.getStringRef().str()] -= number;
    }
    before.erase(found);
  }
  void runAfterPassFailed(Pass *pass, Operation *op) override {
    before.erase(pass);
  }

private:
  using Counts = llvm::DenseMap<OperationName, int64_t>;
  static Counts count(Operation *op) {
    Counts counts;
    op->walk([&](Operation *inner) { ++counts[inner->getName()]; });
    return counts;
  }

  struct State {
    State(Operation *op, Counts counts)
        : print(op), counts(std::move(counts)) {}
    OperationFingerPrint print;
    Counts counts;
  };
  PassReport &report;
  llvm::DenseMap<Pass *, State> before; ///< of those that are running
};

void PassReport::follow(PassManager &passes) {
  passes.addInstrumentation(std::make_unique<Instrumentation>(*this));
}

/// Those that there are more or fewer of, the greatest differences first.
static SmallVector<Count>
sortChanged(const std::map<std::string, int64_t> &all) {
  SmallVector<Count> changed;
  for (const auto &[name, number] : all)
    if (number)
      changed.push_back({name, number});
  llvm::sort(changed, [](const Count &a, const Count &b) {
    return std::pair(-std::abs(a.second), a.first) <
           std::pair(-std::abs(b.second), b.first);
  });
  return changed;
}

void PassReport::writeText(llvm::raw_ostream &out) const {
  constexpr size_t most = 6;
  for (const auto &[pass, entry] : entries) {
    if (!entry.changes)
      continue;
    out << "  " << pass << ": ";
    SmallVector<Count> changed = sortChanged(entry.operations);
    if (changed.empty())
      out << "as many operations of each kind";
    llvm::interleaveComma(ArrayRef(changed).take_front(most), out,
                          [&](const Count &count) {
                            out << (count.second > 0 ? "+" : "") << count.second
                                << " " << count.first;
                          });
    if (changed.size() > most)
      out << ", and " << changed.size() - most << " other kinds";
    out << "\n";
  }
}

void PassReport::writeJSON(llvm::raw_ostream &out) const {
  llvm::json::OStream json(out);
  json.array([&] {
    for (const auto &[pass, entry] : entries)
      json.object([&] {
        json.attribute("pass", pass);
        json.attribute("runs", entry.runs);
        json.attribute("changes", entry.changes);
        json.attributeObject("operations", [&] {
          for (const auto &[name, number] : sortChanged(entry.operations))
            json.attribute(name, number);
        });
      });
  });
  out << "\n";
}
