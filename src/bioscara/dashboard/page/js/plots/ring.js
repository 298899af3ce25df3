// Samples of the last minutes, in arrays that are made once.

/**
 * A ring of rows. Each row is written twice, half of the array apart, so that the newest rows are always one
 * piece that needs no copy.
 */
export class Ring {
  /**
   * @param {number} capacity Number of rows that are kept.
   * @param {number} columns Number of columns without that of the time.
   */
  constructor(capacity, columns) {
    this.capacity = capacity;
    this.times = new Float64Array(2 * capacity);
    this.columns = Array.from({ length: columns }, () => new Float32Array(2 * capacity));
    this.next = 0;
    this.length = 0;
    /** Time of the newest row [s]; minus infinity without one. */
    this.last = -Infinity;
  }

  /** Forget all rows. */
  clear() {
    this.next = this.length = 0;
    this.last = -Infinity;
  }

  /**
   * Add a row; one that is not newer than the newest is left out.
   *
   * @param {number} time Its time [s].
   * @param {(column: number) => number | null | undefined} value Returns the value of a column; null if it is unknown.
   */
  push(time, value) {
    if (!(time > this.last)) return;
    const { capacity, next } = this;
    this.times[next] = this.times[next + capacity] = time;
    for (let column = 0; column < this.columns.length; column += 1) {
      const array = this.columns[column];
      array[next] = array[next + capacity] = value(column) ?? NaN;
    }
    this.last = time;
    this.next = (next + 1) % capacity;
    this.length = Math.min(this.length + 1, capacity);
  }

  /**
   * Return the rows, oldest first, as views of the arrays; valid until the next row.
   *
   * @returns {{times: Float64Array, columns: Float32Array[]}} Times and columns.
   */
  rows() {
    const end = this.next + this.capacity;
    const begin = end - this.length;
    return { times: this.times.subarray(begin, end), columns: this.columns.map((array) => array.subarray(begin, end)) };
  }

  /** Return a copy of the rows, which later ones do not change. @returns {{times: Float64Array, columns: Float32Array[]}} */
  copy() {
    const { times, columns } = this.rows();
    return { times: times.slice(), columns: columns.map((array) => array.slice()) };
  }
}
