// The real program, started for a test and stopped after it.
import { spawn, type ChildProcess } from 'node:child_process'
import { once } from 'node:events'
import { mkdtemp, rm, writeFile } from 'node:fs/promises'
import { tmpdir } from 'node:os'
import { join, resolve } from 'node:path'
import { createInterface } from 'node:readline'
import { fileURLToPath } from 'node:url'

const WEB = fileURLToPath(new URL('..', import.meta.url))
const BINARY = resolve(WEB, process.env.BUSBAR ?? '../target/debug/busbar')

/** One running program. */
class Program {
  #child: ChildProcess

  protected constructor(child: ChildProcess) {
    this.#child = child
  }

  /** Runs `busbar` with these arguments until a line of it holds what is looked for. */
  protected static async spawn(args: string[], wanted: RegExp, env = {}): Promise<[string, ChildProcess]> {
    const stdio = ['ignore', 'pipe', 'pipe'] as ['ignore', 'pipe', 'pipe']
    const child = spawn(BINARY, args, { stdio, env: { ...process.env, ...env } })
    const stray = () => child.kill('SIGKILL')
    process.once('exit', stray)
    child.once('exit', () => process.off('exit', stray))
    let complaint = ''
    child.stderr.on('data', (bytes: Buffer) => (complaint = (complaint + bytes.toString()).slice(-4000)))
    const found = await new Promise<string>((found, failed) => {
      child.once('error', (error) => failed(new Error(`${BINARY} does not start: ${error.message}`)))
      child.once('exit', (code) =>
        failed(new Error(`${BINARY} ${args[0]} ended with ${code}:\n${complaint}`)),
      )
      createInterface({ input: child.stdout }).on('line', (line) => {
        const match = wanted.exec(line)
        if (match) found(match[0])
      })
    })
    return [found, child]
  }

  /** As if its plug was pulled: it says nothing more, but its connections stay. */
  freeze(): void {
    this.#child.kill('SIGSTOP')
  }

  thaw(): void {
    this.#child.kill('SIGCONT')
  }

  /** Ends it as Ctrl-C would, or at once, and waits until it is gone. */
  async stop(signal: 'SIGINT' | 'SIGKILL' = 'SIGINT'): Promise<void> {
    if (this.#child.exitCode !== null || this.#child.signalCode !== null) return
    const gone = once(this.#child, 'exit')
    this.#child.kill('SIGCONT')
    this.#child.kill(signal)
    await gone
  }
}

const PAGE = /http:\/\/127\.0\.0\.1:\d+\//

/** `busbar demo`: the gateway and its imitated controllers in one process. */
export class Demo extends Program {
  private constructor(
    /** The page's address, as the program printed it. */
    readonly address: string,
    child: ChildProcess,
  ) {
    super(child)
  }

  /** On a port of the system's choice, or on the one given. */
  static async start(port = '0'): Promise<Demo> {
    return new Demo(...(await Program.spawn(['demo', '--listen', `127.0.0.1:${port}`], PAGE)))
  }

  get port(): string {
    return new URL(this.address).port
  }
}

/** `busbar emulate`: one imitated controller. */
export class Controller extends Program {
  /** What its control asks for, where it has one. */
  static readonly TOKEN = 'a-token-for-tests-alone'

  private constructor(
    readonly url: string,
    /** Its control's page, where it has one. */
    readonly control: string,
    child: ChildProcess,
  ) {
    super(child)
  }

  static async start(key: string, listen: string, ...rest: string[]): Promise<Controller> {
    const args = ['emulate', '--json', '--listen', listen, ...rest, key]
    const [said, child] = await Program.spawn(args, /^\{.*\}$/, { BUSBAR_CONTROL_TOKEN: Controller.TOKEN })
    const { urls, control } = JSON.parse(said) as { urls: [string]; control?: string }
    return new Controller(urls[0], control ?? '', child)
  }
}

/** `busbar run` on a site of the test's own. */
export class Gateway extends Program {
  #folder: string

  private constructor(
    readonly address: string,
    child: ChildProcess,
    folder: string,
  ) {
    super(child)
    this.#folder = folder
  }

  static async start(site: string, port = '0'): Promise<Gateway> {
    const folder = await mkdtemp(join(tmpdir(), 'busbar-'))
    const file = join(folder, 'site.toml')
    await writeFile(file, site)
    const args = ['run', '--config', file, '--listen', `127.0.0.1:${port}`]
    return new Gateway(...(await Program.spawn(args, PAGE)), folder)
  }

  get port(): string {
    return new URL(this.address).port
  }

  override async stop(signal: 'SIGINT' | 'SIGKILL' = 'SIGINT'): Promise<void> {
    await super.stop(signal)
    await rm(this.#folder, { recursive: true, force: true })
  }
}
