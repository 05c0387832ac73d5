# Of soak.sh's watch.tsv: what each command's processes took at first and at last.

# The median of values[1..count].
function median(values, count,    i, j, value) {
  for (i = 2; i <= count; ++i) {
    value = values[i]
    for (j = i - 1; j > 0 && values[j] > value; --j) values[j + 1] = values[j]
    values[j + 1] = value
  }
  return count == 0 ? 0 : (values[int((count + 1) / 2)] + values[int((count + 2) / 2)]) / 2
}

# A tenth more, and more than 4 MiB or 2 descriptors.
function mark(first, last, least) {
  if (last <= 1.1 * first || last - first <= least) return ""
  grew = 1
  return "  grew"
}

# Medians over the processes of the two parts: value[what, part, i].
# marked: more at last is a leak.
function show(name, what, marked,    part, i, values, memory, open, marks) {
  for (part = 1; part <= 2; ++part) {
    for (i = 1; i <= count[part]; ++i) values[i] = value["memory", part, i]
    memory[part] = median(values, count[part]) / 1024
    for (i = 1; i <= count[part]; ++i) values[i] = value["open", part, i]
    open[part] = median(values, count[part])
  }
  marks = marked ? mark(memory[1], memory[2], 4) mark(open[1], open[2], 2) : ""
  printf "%-10s %-28s %9.1f %9.1f %9.1f %9.1f%s\n", name, what, memory[1], memory[2], open[1], open[2], marks
}

function add(part, memory, open) {
  ++count[part]
  value["memory", part, count[part]] = memory
  value["open", part, count[part]] = open
}

{
  id = $1 "." $3  # numbers of processes come again
  if (!(id in birth)) { birth[id] = $4; command[id] = $2; of_round[id] = $1; commands[$2] = 1 }
  death[id] = $4
  if ($5 > peak[id]) peak[id] = $5
  if ($6 > most[id]) most[id] = $6
  line[NR] = $0
}

END {
  for (i = 1; i <= NR; ++i) {
    split(line[i], field, "\t")
    id = field[1] "." field[3]
    if (death[id] - birth[id] < 60) continue
    age = (field[4] - birth[id]) / (death[id] - birth[id])
    part = age >= 0.75 ? 2 : age >= 0.25 && age < 0.5 ? 1 : 0
    if (part == 0) continue
    ++seen[id, part]
    memory_sum[id, part] += field[5]
    open_sum[id, part] += field[6]
  }
  printf "%-10s %-28s %9s %9s %9s %9s\n", "processes", "", "MiB", "MiB", "open", "open"
  for (name in commands) {
    count[1] = count[2] = 0
    for (id in peak)
      if (command[id] == name && of_round[id] <= rounds / 3) add(1, peak[id], most[id])
      else if (command[id] == name && of_round[id] > 2 * rounds / 3) add(2, peak[id], most[id])
    if (count[1] > 0) show(name, "peaks, first / last third", 1)
    count[1] = count[2] = 0
    for (id in peak)
      for (part = 1; command[id] == name && part <= 2; ++part)
        if (seen[id, part] > 0)
          add(part, memory_sum[id, part] / seen[id, part], open_sum[id, part] / seen[id, part])
    # A sweep, a tune and their workers do one thing after another; a viewer always the same.
    if (count[1] > 0) show(name, "over a minute, quarter 2 / 4", name == "view")
  }
  exit grew
}
