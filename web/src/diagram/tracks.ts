// The level parts of lines between two layers: each on a track of its own where it would meet another one.

/** Where a line enters the channel. */
export interface Pin {
  node: string
  x: number
  /** The edge of the channel it comes from. */
  side: 'top' | 'bottom'
}

export interface Route {
  connection: number
  /** The upper end first. */
  pins: readonly [Pin, Pin]
  /** The layer above which the line is drawn; the channel below that layer. */
  channel: number
}

/** Nearer than this two upright lines could be taken for one. */
const NEAR = 14

/**
 * The track of each route that is not straight, 0 the uppermost. Of two lines that come from above and from below at one
 * place, the one from above turns off first. Undefined where they would need each other to be first.
 */
export function tracksOf(routes: readonly Route[]): Map<Route, number> | undefined {
  const bent = routes.filter((route) => !isStraight(route))
  const straight = routes.filter(isStraight)
  if (bent.some((route) => straight.some((other) => meets(route, other)))) return undefined
  const tracks = new Map(bent.map((route) => [route, 0]))
  const track = (route: Route) => tracks.get(route) ?? 0
  // Each round moves down what must be lower; without a ring among them that comes to an end.
  const most = bent.length * bent.length + 1
  for (let round = 0; round < most; round += 1) {
    let moved = false
    bent.forEach((route, index) => {
      const floor = Math.max(
        0,
        ...bent.filter((other) => other !== route && isAbove(other, route)).map((other) => track(other) + 1),
      )
      let place = Math.max(track(route), floor)
      while (bent.slice(0, index).some((other) => track(other) === place && overlap(route, other))) place += 1
      if (place === track(route)) return
      tracks.set(route, place)
      moved = true
    })
    if (!moved) return tracks
  }
  return undefined
}

function isStraight({ pins: [one, two] }: Route): boolean {
  return one.side !== two.side && one.x === two.x
}

/** `upper` comes down where `lower` goes down to. */
function isAbove(upper: Route, lower: Route): boolean {
  return upper.pins.some(
    (pin) =>
      pin.side === 'top' &&
      lower.pins.some((other) => other.side === 'bottom' && Math.abs(pin.x - other.x) < NEAR),
  )
}

/** An upright part of one would lie on the other, which is straight. */
function meets(route: Route, straight: Route): boolean {
  return route.pins.some((pin) => Math.abs(pin.x - straight.pins[0].x) < NEAR)
}

function overlap(one: Route, other: Route): boolean {
  const [a, b] = [spanOf(one), spanOf(other)]
  return a[0] <= b[1] + NEAR && b[0] <= a[1] + NEAR
}

function spanOf({ pins: [one, two] }: Route): [number, number] {
  return [Math.min(one.x, two.x), Math.max(one.x, two.x)]
}
