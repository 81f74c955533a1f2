// One choice of units for the whole page.
import { keepChoice, keptChoice, shown, type Choice, type Shown } from '../logic/units'

class Units {
  choice = $state.raw<Choice>(keptChoice())

  set(change: Choice): void {
    this.choice = { ...this.choice, ...change }
    keepChoice(this.choice)
  }

  /** A value as it is to be shown; cards, points, diagram and screens all ask here. */
  show(value: number, unit: string | null | undefined, decimals?: number): Shown {
    return shown(value, unit, this.choice, decimals)
  }

  /** The same in one piece, which no line end parts. */
  text(value: number, unit: string | null | undefined, decimals?: number): string {
    const { number, unit: print } = this.show(value, unit, decimals)
    return print ? `${number}\u00a0${print}` : number
  }
}

export const units = new Units()
