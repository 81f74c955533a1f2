// Where everything of the diagram stands: as an electrician draws it where there is room, else row by row.
import type { Layout } from './geometry'
import { ladder } from './ladder'
import { tree } from './tree'
import type { Diagram } from './types'

export function layoutOf(diagram: Diagram, width: number): Layout {
  const wide = tree(diagram)
  return wide && wide.width <= width ? wide : ladder(diagram, width)
}
